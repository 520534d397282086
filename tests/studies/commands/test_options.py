"""Groups of options: a command takes dataclasses, a user sees an option for each of their fields."""

import inspect
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import pytest
import typer
from typer.testing import CliRunner

from fem_models.rig.checks import RigError
from studies.commands import cli
from studies.commands.options import Common, Output, ProgramChoice, RigChoice, with_option_groups


@dataclass(frozen=True)
class Size:
    width: Annotated[float, typer.Option("--width", help="Width, mm.")]
    count: Annotated[int, typer.Option("--count", min=1, help="Number.")] = 2


@dataclass(frozen=True)
class Named(Size):
    kind: Annotated[Literal["round", "flat"], typer.Option("--kind", help="Shape.")] = "round"


def run(command, *arguments: str):
    app = typer.Typer(rich_markup_mode=None)
    app.command("do")(with_option_groups(command))
    return CliRunner().invoke(app, list(arguments))


def test_the_command_gets_dataclasses():
    got = []

    def command(file: Annotated[Path, typer.Argument(help="A file.")], size: Named, common: Common) -> None:
        """Do something."""
        got.extend([file, size, common])

    done = run(command, "a.csv", "--width", "1.5", "--kind", "flat", "--seed", "3", "--json")
    assert done.exit_code == 0, done.output
    assert got == [Path("a.csv"), Named(1.5, 2, "flat"), Common(seed=3, json=True)]


def test_help_shows_every_field_in_the_order_of_the_declaration():
    def command(*, size: Named, last: Annotated[bool, typer.Option("--last")] = False, common: Common) -> None:
        """Do something."""

    text = run(command, "--help").output
    shown = re.findall(r"^  (--\w+)", text, re.M)
    assert shown[:7] == ["--width", "--count", "--kind", "--last", "--seed", "--quiet", "--json"]
    assert "Do something." in text
    assert re.search(r"--width.*Width, mm\..*\[required\]", text)
    assert re.search(r"--count.*\[default: 2; x>=1\]", text)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "--width"),
        (["--width", "wide"], "'--width'"),
        (["--width", "1", "--count", "0"], "--count"),
        (["--width", "1", "--kind", "square"], "'square'"),
        (["--width", "1", "--colour", "red"], "--colour"),
    ],
)
def test_options_of_a_group_are_checked(arguments, said):
    def command(size: Named) -> None:
        pytest.fail("called with wrong options")

    done = run(command, *arguments)
    assert done.exit_code == 2
    assert said in done.output


def test_two_groups_must_not_have_the_same_option():
    @dataclass(frozen=True)
    class Other:
        count: Annotated[int, typer.Option("--count")] = 1

    def command(size: Size, other: Other) -> None: ...

    command.__annotations__ = {"size": Size, "other": Other}
    with pytest.raises(TypeError, match="option count is in two groups"):
        with_option_groups(command)


def test_the_command_itself_can_still_be_called():
    got = []

    def command(size: Size) -> None:
        got.append(size)

    wrapped = with_option_groups(command)
    wrapped.__wrapped__(Size(1.0))
    wrapped(width=2.0, count=5)
    assert got == [Size(1.0), Size(2.0, 5)]
    assert list(inspect.signature(wrapped).parameters) == ["width", "count"]


def options_of(name: str) -> list[str]:
    groups = {"data ": cli.DATA_COMMANDS, "record ": cli.RECORD_COMMANDS, "": cli.COMMANDS}
    commands = {group + name: command for group, known in groups.items() for name, command in known.items()}
    return list(inspect.signature(with_option_groups(commands[name].load())).parameters)


COMMON = ["seed", "quiet", "json"]
OPTIONS = {
    "run": ["records", "out", "rig", "preset", "preload", "amplitude", "ensemble", "force", *COMMON],
    "simulate": [
        "out", "preset", "rig", "preload", "amplitude", "cycles", "step", "rate", "program", "circle", "engine",
        "dynamic", "ensemble", "force", *COMMON,
    ],
    "validate": ["out", "preset", "rig", "preload", "amplitude", "force", *COMMON],
    "identify": [
        *["records", "out", "each", "table", "workers", "method", "seeds", "elements", "law", "delay", "plane"],
        *["force", *COMMON],
    ],
    "separate": ["out", "records", "preset", "rig", "preload", "amplitude", "engine", "ensemble", "force", *COMMON],
    "trace": ["records", "out", "reference", "threads", "alpha", "force", *COMMON],
    "effects": COMMON,
    "compensate": ["record", "reference", "out", "elements", "law", "delay", "force", *COMMON],
    "study": ["file", "out", "workers", "scheduler", "retry", "ensemble", "seed", "force", "quiet", "json"],
    "report": ["folder", "pdf", "force", *COMMON],
    "app": ["preset", "rig", "preload", "amplitude", "port", "record", "no_browser", *COMMON],
    "record new": [
        "table", "preset", "rig", "preload", "drive_column", "angle_column", "time_column", "cycle_column",
        "drive_unit", "angle_unit", "time_unit", "no_time", "encoding", "sheet", "title", "out", *COMMON,
    ],
    "data list": COMMON,
    "data fetch": ["name", "out", "force", *COMMON],
}  # fmt: skip
"""Every option and argument that users rely on, in the order of the help."""


@pytest.mark.parametrize("command", OPTIONS)
def test_no_option_of_a_command_is_lost(command):
    assert options_of(command) == OPTIONS[command]


def test_a_rig_is_a_preset_or_a_file(tmp_path):
    assert RigChoice(preset="du2018", preload=12.0).read().preload_N == 12.0
    for choice in (RigChoice(), RigChoice("du2018", tmp_path / "mine.toml")):
        with pytest.raises(RigError, match="either --preset or --rig"):
            choice.read()


def test_a_program_is_made_or_read(tmp_path):
    (tmp_path / "drive.csv").write_text("drive_mm\n0\n1\n0\n")
    assert ProgramChoice(program=tmp_path / "drive.csv").read().drive_mm.tolist() == [0, 1, 0]
    triangle, sine = ProgramChoice(amplitude=1.0, step=0.5).read(), ProgramChoice(amplitude=1.0, rate=2.0).read()
    assert triangle.time_s is None
    assert (triangle.drive_mm.max(), sine.time_s[-1]) == (1.0, pytest.approx(0.625))  # 1.25 periods at 2 Hz
    with pytest.raises(RigError, match="--amplitude or --program"):
        ProgramChoice().read()
    with pytest.raises(RigError, match=r"--cycles 3: --program .*drive\.csv has the whole program"):
        ProgramChoice(cycles=3, program=tmp_path / "drive.csv").read()
    with pytest.raises(RigError, match=r"--step 0\.1: .*--rate 2\.0"):
        ProgramChoice(amplitude=1.0, step=0.1, rate=2.0).read()


def test_output_is_json_or_text_or_nothing(capsys):
    shown = {}
    for name, output in {"text": Output(), "json": Output(json=True), "quiet": Output(quiet=True)}.items():
        output.show({"a": float("nan")}, "a line")
        shown[name] = capsys.readouterr().out
    assert shown == {"text": "a line\n", "json": '{\n  "maker": "notchbend",\n  "a": NaN\n}\n', "quiet": ""}
    assert [Output().shows_progress, Output(json=True).shows_progress, Output(True).shows_progress] == [1, 0, 0]
