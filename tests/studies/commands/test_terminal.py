"""What a user meets first: help, version, progress, and a command that is stopped."""

import io
import re
import resource
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import pytest
from numba.core import event
from rich.console import Console

from fem_models.load import LoadProgram
from fem_models.rig import preset
from hysteresis.records import sidecar
from studies import engines, progress
from studies.commands import cli
from studies.commands.tables import verdict_lines
from studies.fetch import CATALOGUE
from studies.report.summary import Verdict
from studies.sweep.study_file import ready_studies
from validation.tracing.search.search import FitCount

ROOT = Path(__file__).parents[3]
GROUPS = {
    "": cli.COMMANDS,
    "data ": cli.DATA_COMMANDS,
    "practice ": cli.PRACTICE_COMMANDS,
    "record ": cli.RECORD_COMMANDS,
}
ALL = {
    group + name: cli.command_of(name, entry) for group, entries in GROUPS.items() for name, entry in entries.items()
}
ENTRIES = {group + name: entry for group, entries in GROUPS.items() for name, entry in entries.items()}
CHAIN = ["simulate", "--preset", "du2018", "--amplitude", "2.2", "--engine", "chain", "--quiet"]
DRAWING = {"pyvista", "vtkmodules", "matplotlib", "plotly", "trame", "jinja2"}
ELSEWHERE = {"exudyn", "gmsh", "skfem", "meshio", "pandas", "xarray", "zarr", "dask", "distributed", "SALib", "pymoo"}


def modules_after(*arguments: str, folder: Path = ROOT) -> tuple[set[str], float, str]:
    """Top-level modules and `scipy.stats` that a command has loaded, its processor time, s, and what it printed."""
    code = (
        f"import sys; sys.path.insert(0, {str(ROOT)!r})\n"
        "from studies.commands.cli import call\n"
        f"call({list(arguments)!r})\n"
        "print('LOADED', *({name.split('.')[0] for name in sys.modules} | {'scipy.stats'} & set(sys.modules)))\n"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    printed, loaded = done.stdout.split("LOADED ")
    return set(loaded.split()), seconds, printed


@pytest.mark.parametrize("arguments", [["--help"], [], ["--version"], ["data"]])
def test_help_loads_no_library_of_numbers(arguments):
    """The list of commands stands alone: no command and none of the libraries below is imported. A second at most."""
    loaded, seconds, printed = modules_after(*arguments)
    assert printed
    assert not loaded & (DRAWING | ELSEWHERE | {"numpy", "scipy", "numba", "hysteresis", "fem_models", "validation"})
    assert seconds < 1.0  # 0.1 s on the machine this was written on


def test_the_chain_loads_what_it_uses(tmp_path):
    modules_after(*CHAIN, "--out", "warm.csv", folder=tmp_path)  # compiles what is not in the cache yet
    loaded, seconds, _ = modules_after(*CHAIN, "--out", "loop.csv", folder=tmp_path)
    assert not loaded & (DRAWING | ELSEWHERE | {"validation"})
    assert seconds < 2.5 * 2  # 1.4 s on a quiet machine; other processes on the same core add to it


def test_no_command_shows_the_help(capsys):
    assert cli.call([]) == 2  # as usual for commands of this kind
    shown = capsys.readouterr()
    assert shown.out.startswith("Usage: notchbend [OPTIONS] COMMAND [ARGS]...")
    assert shown.err == ""
    assert cli.call(["data"]) == 2
    assert "fetch" in capsys.readouterr().out


def test_version(capsys):
    assert cli.call(["--version"]) == 0
    assert capsys.readouterr().out == f"notchbend {version('notchbend')}\n"


def test_an_unknown_command_is_answered_with_the_known_ones(capsys):
    assert cli.call(["simulat"]) == 2
    expected = f"notchbend: simulat: no such command: expected one of {', '.join([*cli.COMMANDS, *cli.GROUPS])}\n"
    assert capsys.readouterr().err == expected


@pytest.mark.parametrize("name", ALL)
def test_every_option_says_what_it_does_and_its_default(name):
    for parameter in ALL[name].params:
        said = parameter.help or ""
        assert len(said) > 10, parameter.name
        if parameter.param_type_name == "option" and not parameter.required and parameter.default is None:
            assert re.search(r"by default|in place of|or --", said, re.IGNORECASE), f"{parameter.name}: {said}"


@pytest.mark.parametrize("name", ALL)
def test_examples_are_shown_and_taken(name, capsys):
    group, _, last = name.rpartition(" ")
    assert cli.call([*name.split(), "--help"]) == 0
    shown = capsys.readouterr().out
    assert ENTRIES[name].examples
    for example in ENTRIES[name].examples:
        assert f"  {example}\n" in shown
        words = example.split()
        assert words[: 1 + len(name.split())] == ["notchbend", *name.split()]
        given = cli.one_value_each(words[1:])[len(name.split()) :]
        ALL[name].make_context(last, given)  # raises where an option is unknown or a value is missing
    assert len(f"  {last:<10}  {ENTRIES[name].summary}") <= 80, group


@pytest.mark.parametrize("first", [["--reference", "a.csv"], ["--reference=a.csv"]])
def test_all_values_after_an_option_are_its_own(first):
    """With an equals sign the second one had become a new record."""
    given = cli.one_value_each(["trace", "new.csv", *first, "b.csv", "--out", "o"])
    assert given == ["trace", "new.csv", *first, "--reference", "b.csv", "--out", "o"]


def test_preloads_of_a_run_end_where_its_records_begin():
    """As `run --rig F [--preload N...] [RECORD...]` says; the second preload had been taken for a record."""
    given = ["run", "--rig", "mine.toml", "--preload", "10", "20", "a.csv", "b.csv", "--out", "o"]
    assert cli.one_value_each(given) == [*given[:5], "--preload", *given[5:]]
    assert cli.one_value_each(["run", "--preload", "10", "a.csv"]) == ["run", "--preload", "10", "a.csv"]


def test_names_in_examples_are_there():
    assert ENTRIES["data fetch"].examples[0].split()[3] in CATALOGUE
    assert ENTRIES["study"].examples[0].split()[2] in ready_studies()


def columns_of(text: str) -> list[str]:
    return [line for line in text.splitlines() if line.strip()]


def test_progress_of_a_command_that_is_piped_is_lines(monkeypatch, capsys):
    monkeypatch.setattr(progress, "FIRST_S", 0.05)
    monkeypatch.setattr(progress, "NEXT_S", 0.05)
    with progress.steps(True, 4) as step:
        step("first")
        step("second")
        time.sleep(0.18)
    lines = columns_of(capsys.readouterr().err)
    assert lines[0] == "second, 1 of 4 (25 %), 0 s"
    assert 2 <= len(lines) <= 4


def test_progress_of_a_short_or_a_quiet_command_is_nothing(monkeypatch, capsys):
    with progress.steps(True, 2) as step:
        step("short")
    monkeypatch.setattr(progress, "FIRST_S", 0.01)
    with progress.counted(False, "quiet") as count:
        count(1, 2)
        time.sleep(0.05)
    assert capsys.readouterr() == ("", "")


def test_progress_on_a_terminal_has_count_share_and_time(monkeypatch):
    shown = io.StringIO()
    monkeypatch.setattr(progress, "Console", lambda stderr: Console(force_terminal=True, width=100, file=shown))
    with progress.counted(True, "cases [of mine]") as count:
        count(3, 12)
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.getvalue())
    assert "cases [of mine]" in text
    assert "3 of 12 (25 %)" in text
    assert "0:00:0" in text


KERNEL = """
import sys, time
from numba import njit
from studies import progress

progress.FIRST_S = progress.NEXT_S = 0.01
progress.NEXT_SHARE = 0.0

@njit(cache=True)
def kernel(x):
    for i in range(3):
        x = (x, i)[0] + 1.0
    return x

with progress.steps(True, 2) as step:
    step("first")
    kernel(1.0)
    sys.stderr.write("compiled\\n")
    time.sleep(0.3)
"""


def test_kernels_that_are_compiled_are_said_once(tmp_path):
    """A command stood at "cross-checking, 9 %" for two minutes: kernels were compiled, which it did not say."""
    (tmp_path / "kernel.py").write_text(KERNEL)

    def lines() -> tuple[str, str]:
        code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); import kernel"
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
        before, after = done.stderr.split("compiled\n")
        return before, after

    before, after = lines()
    assert f"first ({progress.COMPILING}), 0 of 2 (0 %), " in before
    assert progress.COMPILING not in after
    assert "first, 0 of 2 (0 %), " in after
    assert progress.COMPILING not in "".join(lines())  # read from the cache on disk


def test_compiling_stands_in_place_of_the_words_on_a_terminal(monkeypatch):
    shown = io.StringIO()
    monkeypatch.setattr(progress, "Console", lambda stderr: Console(force_terminal=True, width=80, file=shown))
    with progress.steps(True, 4) as step:
        step("first")
        event.start_event("numba:compile")
        time.sleep(0.3)  # a terminal is drawn ten times a second
        event.end_event("numba:compile")
    assert progress.COMPILING in shown.getvalue()


def test_progress_stays_in_one_line_of_a_terminal(monkeypatch):
    shown = io.StringIO()
    monkeypatch.setattr(progress, "Console", lambda stderr: Console(force_terminal=True, width=80, file=shown))
    with progress.stages(True, "tracing", 5, "fits") as stage:
        stage.count("superelastic_plateau + tendon_stiffening, from the start of the baseline", 130, 213)
        time.sleep(0.3)
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.getvalue())
    assert re.search("tracing, step 1 of 5: sup.*… ━.* 130 of 213 fits \\(61 %\\) 0:00:00", text)


def test_a_count_says_how_long_the_rest_takes(monkeypatch, capsys):
    monkeypatch.setattr(progress, "FIRST_S", 0.25)
    with progress.bar(True) as shown:
        task = shown.add_task("cases", total=3_000_000, left=True)
        for _ in range(2):
            time.sleep(0.1)
            shown.update(task, advance=1_000_000)
        time.sleep(0.1)
    assert re.fullmatch(r"cases, 2000000 of 3000000 \(67 %\), \d s left, 0 s\n", capsys.readouterr().err)


def test_stages_count_their_parts_and_what_follows_counts_nothing(monkeypatch, capsys):
    """A trace had stood at 0 of 5 while it fitted for four minutes."""
    monkeypatch.setattr(progress, "FIRST_S", 0.05)
    monkeypatch.setattr(progress, "NEXT_S", 0.1)
    with progress.stages(True, "tracing", 5, "fits") as stage:
        stage.count("backlash", 3, 12)
        time.sleep(0.1)
        stage.begin("figures")
        time.sleep(0.1)
    lines = columns_of(capsys.readouterr().err)
    assert lines[0] == "tracing, step 1 of 5: backlash, 3 of 12 fits (25 %), 0 s"
    assert lines[1] == "tracing, step 2 of 5: figures, 0 s"


def test_stages_within_a_step_stand_behind_its_words(monkeypatch, capsys):
    monkeypatch.setattr(progress, "FIRST_S", 0.05)
    with progress.steps(True, 4) as step:
        step("first")
        step("tracing bench")
        step.within("fits").count("backlash", 3, 12)
        time.sleep(0.1)
    said = "tracing bench: backlash, 3 of 12 fits, 1 of 4 (25 %), 0 s\n"
    assert capsys.readouterr().err == said


def test_fits_of_a_trace_are_counted():
    said = []
    count = FitCount(lambda *one: said.append(one))
    for words, ahead in (("baseline", 2), ("backlash", 3), ("gravity", 2), ("gravity, refined", 0), ("slack", 0)):
        count(words, ahead)
    assert [one[1:] for one in said] == [(0, 3), (1, 5), (2, 5), (3, 5), (4, 5)]


def test_the_multibody_model_counts_its_samples():
    seen = []
    program = LoadProgram([0.0, 0.1, 0.2])
    engines.simulate_counted(preset("du2018"), program, "multibody", lambda *one: seen.append(one))
    assert seen == [(1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(
    ("number", "code", "word"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "terminated")]
)
def test_a_stopped_command_ends_in_one_line(number, code, word, tmp_path, capsys, monkeypatch):
    def stopped(rig, program):
        signal.raise_signal(number)
        time.sleep(1)

    before = {one: signal.getsignal(one) for one in (signal.SIGINT, signal.SIGTERM)}
    signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setitem(engines.ENGINES, "chain", stopped)
    monkeypatch.setattr(sys, "argv", ["notchbend", *CHAIN, "--out", str(tmp_path / "loop.csv")])
    try:
        with pytest.raises(SystemExit) as ended:
            cli.main()
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
    assert ended.value.code == code
    said = f"notchbend: {word}: no file is half-written, the same command starts again\n"
    assert capsys.readouterr() == ("", said)
    assert list(tmp_path.iterdir()) == []


def test_the_report_ends_in_its_summary_rows():
    rows = [
        Verdict("holds", "Bending", "45.0 deg", "as the paper [states]", "loops", "notchbend run"),
        Verdict("look", "Peak strain", "2.0 %", "limits exceeded", "rig", "notchbend run"),
    ]
    assert verdict_lines(rows) == [
        "ok    Bending                   45.0 deg",
        "      as the paper [states]",
        "LOOK  Peak strain               2.0 %",
        "      limits exceeded",
    ]


def test_toml_of_yes_and_no():
    assert sidecar.toml({"a": True, "b": {"c": False}}) == "a = true\n\n[b]\nc = false\n"
