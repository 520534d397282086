"""The table of false names over alpha, and the lines that it is made of."""

from validation.practice.false_claims import ALPHAS, Claims, table
from validation.practice.gate import ROWS
from validation.practice.kept_lines import append, read_lines


def line(number, label, false, row="clean"):
    verdicts = tuple("effect" if name else "none" for name in false)
    return Claims(row, 3, number, label, (0.03, 0.03, 0.03), verdicts, false, 1.0)


def test_false_names_are_counted_at_each_alpha_for_each_make_and_all():
    lines = [
        line(0, "lumped", ("", "gravity", "gravity")),
        line(1, "lumped", ("", "", "tip_load")),
        line(2, "maxwell slip", ("", "", "")),
        line(0, "coarse", ("", "", "run_in"), row="sensors"),
    ]
    cells = [[cell.split(" (")[0].strip() for cell in row.split("|")[1:-1]] for row in table(lines)[2:]]
    rows = {name: counts for name, *counts in cells}
    assert rows == {
        "lumped": ["0 of 2", "1 of 2", "2 of 2"],
        "maxwell slip": ["0 of 1", "0 of 1", "0 of 1"],
        "clean": ["0 of 3", "1 of 3", "2 of 3"],
        "sensors": ["0 of 1", "0 of 1", "1 of 1"],
    }


def test_the_clean_makes_are_those_of_the_gate_and_lines_are_read_back(tmp_path):
    assert len(ROWS["clean"].labels) == len(ALPHAS) == 3
    one = line(0, "lumped", ("", "", "gravity"))
    append(tmp_path / "claims.jsonl", one)
    assert read_lines(tmp_path / "claims.jsonl", Claims) == [one]
    assert read_lines(tmp_path / "none.jsonl", Claims) == []


def test_a_line_that_a_stop_tore_is_drawn_again(tmp_path):
    path, one = tmp_path / "claims.jsonl", line(0, "lumped", ("", "", "gravity"))
    append(path, one)
    with path.open("a", encoding="utf-8") as file:
        file.write('{"row": "clean", "se')
    assert read_lines(path, Claims) == [one]
    append(path, line(1, "lumped", ("", "", "")))
    assert len(read_lines(path, Claims)) == 2
