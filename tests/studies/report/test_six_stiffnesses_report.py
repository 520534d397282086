"""The page of ``validate`` of a rig in space: section and solid of its notches, and the bent wrist."""

import json
import re
from dataclasses import astuple

import pytest

from hysteresis.records.record import RecordError
from studies.commands.cli import call
from studies.report.parts.stiffnesses import read_six
from studies.results import write_result
from studies.results.validation import FILE_IN_SPACE, SixNumbers, StoredBending, StoredNotch, StoredSix

SOLID = SixNumbers(150.0, 40000.0, 5600.0, 11600.0, 2250.0, 1285.0)
RATIO = SixNumbers(0.94, 1.02, 0.97, 1.44, 0.98, 1.51)
SECTION = SixNumbers(*(one * part for one, part in zip(astuple(SOLID), astuple(RATIO), strict=True)))


def result(depths: tuple[float, ...] = (1.58, 1.58, 1.6)) -> StoredSix:
    models = ("chain, solid", 20.0), ("chain, section", 20.5)
    return StoredSix(
        schema=1,
        rig="mine",
        notches=tuple(StoredNotch(k + 1, depth, 0.6, SECTION, SOLID, RATIO) for k, depth in enumerate(depths)),
        drives_mm=((0.6, 0.0), (0.0, 0.6)),
        bent=tuple(
            tuple(StoredBending(name, bending, 0.0, (23.0, 4.0, 0.0)) for name, bending in both)
            for both in ([(name, (y, 0.0)) for name, y in models], [(name, (0.0, z)) for name, z in models])
        ),
        notes=("multibody, section: none found",),
    )


@pytest.fixture
def folder(tmp_path):
    write_result(tmp_path / FILE_IN_SPACE, result())
    return tmp_path


def page(folder) -> str:
    assert call(["report", str(folder), "--quiet"]) == 0
    return re.sub(r"<script\b.*?</script>", "", (folder / "report.html").read_text(), flags=re.S)


def test_the_page_has_notches_and_the_bent_wrist(folder):
    text = page(folder)
    assert 'href="#six-stiffnesses"' in text
    assert text.count('class="still"') == 2  # rotations, displacements
    assert re.findall(r'<tr><th scope="row">([^<]*)</th><td class="n">([\d.]*)</td>', text) == [
        ("1 to 2", "1.580"),
        ("3", "1.600"),
    ]
    assert "150.0<br>(-6.0 %)" in text
    assert text.count("20.5000") == 2
    assert "none found" in text
    assert re.search(r'<td class="found">(.*?)</td>', text)[1] == "-6 %"
    assert "differs by 0.5 deg between the models" in text


def test_notches_that_are_alike_are_one_row_without_a_chart(tmp_path):
    write_result(tmp_path / FILE_IN_SPACE, result((1.6, 1.6)))
    text = page(tmp_path)
    assert 'class="still"' not in text
    assert '<th scope="row">1 to 2</th>' in text


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"notches": []}, "notches: empty"),
        ({"drives_mm": [[0.6, 0.0]]}, "drives_mm, bent: 1, 2"),
        ({"schema": 2}, "schema = 2: expected 1"),
        ({"bent": [[{"name": "chain"}]]}, "bent"),
    ],
)
def test_a_spoiled_result_is_refused_in_one_line(folder, change, said):
    path = folder / FILE_IN_SPACE
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(RecordError, match=said) as caught:
        read_six(folder)
    assert "\n" not in str(caught.value)
    assert call(["report", str(folder), "--quiet"]) == 2
    assert not (folder / "report.html").exists()
