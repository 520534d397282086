"""Study tendon-driven notched Nitinol manipulators: simulate, identify, separate, trace, compensate."""
# The text above opens the help. Modules of commands are imported when a command is called: the help itself needs none.

from __future__ import annotations

import functools
import inspect
import io
import shlex
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import typer
from typer.core import TyperGroup

from studies.stops import StoppedError, asked_to_stop, end, leave, stoppable, watch

if TYPE_CHECKING:  # its name for the base of a command is private
    from typer.core import TyperCommand

BAD_INPUT = 2
"""Exit code of bad input and wrong usage."""
NOT_OF_RESULTS = {"quiet": "--quiet", "json": "--json", "force": "--force"}
"""Options that change no result: a page does not show them in the command that made it."""


@dataclass(frozen=True)
class Entry:
    """A command: its line in the list of commands, ``module:function`` below ``studies``, and examples for its help."""

    summary: str
    where: str
    examples: tuple[str, ...]

    def load(self) -> Callable[..., None]:
        """Import the function."""
        module, name = self.where.split(":")
        loaded: Callable[..., None] = getattr(import_module(f"studies.{module}"), name)
        return loaded


COMMANDS: dict[str, Entry] = {
    "run": Entry(
        "Write the design report of your rig and records.",
        "commands.simulation:run",
        (
            "notchbend run --out results/first-report",
            "notchbend run --rig mine.toml --preload 10 --preload 20 bench-10N.csv bench-20N.csv --out results/mine",
        ),
    ),
    "simulate": Entry(
        "Run one load program on one rig: a record.",
        "commands.simulation:simulate",
        (
            "notchbend simulate --preset du2018 --preload 20 --amplitude 2.2 --out loop.csv",
            "notchbend simulate --rig mine.toml --amplitude 2 --cycles 3 --engine chain --out mine.csv",
            "notchbend simulate --preset du2018 --program drive.csv --out loop.csv",
            "notchbend simulate --preset zhang2026 --amplitude 1 --circle --out circle.csv",
        ),
    ),
    "validate": Entry(
        "Compare all models of a rig side by side.",
        "commands.simulation:validate",
        ("notchbend validate --out results/models", "notchbend validate --preset du2018 --out results/models --json"),
    ),
    "identify": Entry(
        "Identify the hysteresis of records.",
        "commands.records:identify",
        (
            "notchbend identify bench.csv --out results/fit",
            "notchbend identify bench-10N.csv bench-20N.csv --law auto --seeds 3 --out results/fit",
        ),
    ),
    "separate": Entry(
        "Divide a loop into friction, tendon elasticity, material.",
        "commands.records:separate",
        (
            "notchbend separate --preset du2018 --preload 20 --out results/parts",
            "notchbend separate bench-10N.csv bench-20N.csv --out results/parts",
        ),
    ),
    "trace": Entry(
        "Trace the residual to the effect that the model lacks.",
        "commands.records:trace",
        (
            "notchbend trace bench-10N.csv bench-20N.csv --out results/trace",
            "notchbend trace today.csv --reference january.csv --out results/change",
        ),
    ),
    "follow": Entry(
        "Follow one device over days or uses: what changed, why.",
        "follow.command:follow",
        (
            "notchbend follow day-*.csv --out results/follow",
            "notchbend follow day-*.csv --times days.csv --limit width=1.5 --out results/follow",
        ),
    ),
    "effects": Entry(
        "List the effects that trace knows.",
        "commands.records:effects",
        ("notchbend effects", "notchbend effects --json"),
    ),
    "compensate": Entry(
        "Find the drive that makes the angle follow a reference.",
        "commands.records:compensate",
        (
            "notchbend compensate bench.csv --reference wanted.csv --out drive.csv",
            "notchbend compensate results/fit/identify.json --reference wanted.csv --out drive.csv",
            "notchbend compensate wrist.toml --reference circle.csv --out drives.csv",
        ),
    ),
    "workspace": Entry(
        "Find what the tip of a rig in space reaches.",
        "commands.workspace:workspace_of_rig",
        ("notchbend workspace --preset zhang2026 --amplitude 1.2 --out results/workspace",),
    ),
    "import": Entry(
        "Make a rig file of a drawing, a table of notches or a curve.",
        "drawings.commands:import_rig",
        (
            "notchbend import flat.dxf --rig base.toml --out mine.toml",
            "notchbend import notches.csv --preset du2018 --out mine.toml",
            "notchbend import joint-curve.csv --rig base.toml --out mine.toml",
        ),
    ),
    "export": Entry(
        "Write a rig for MuJoCo or a workshop, a compensator for firmware.",
        "export:export_rig",
        (
            "notchbend export --preset du2018 --preload 20 --to mujoco --out du2018.xml",
            "notchbend export bench.csv --to mujoco --out joint.xml",
            "notchbend export results/fit --to c --out firmware",
            "notchbend export bench.csv --to c --out firmware",
            "notchbend export results/fit --to fmu --out unit",
            "notchbend export --rig mine.toml --to dxf --kerf 0.02 --out mine.dxf",
            "notchbend export --rig mine.toml --to step --out mine.step",
        ),
    ),
    "calibrate": Entry(
        "Find the shortest motion that fixes the compensator of a rig.",
        "calibrate.command:calibrate",
        (
            "notchbend calibrate --rig mine.toml --out motion.csv",
            "notchbend calibrate --preset du2018 --amplitude 2.2 --minutes 3 --out motion.csv",
        ),
    ),
    "study": Entry(
        "Run a parametric study; it can be stopped and resumed.",
        "commands.study:study",
        ("notchbend study preload --out results/preload", "notchbend study mine.toml --workers 4 --out results/mine"),
    ),
    "design": Entry(
        "Find tubes that meet a requirement, and how surely.",
        "commands.design:design",
        ("notchbend design require.toml --out results/design",),
    ),
    "report": Entry(
        "Write the report again from stored results.",
        "commands.study:report",
        ("notchbend report results/first-report", "notchbend report results/first-report --pdf"),
    ),
    "app": Entry(
        "Open a local page with sliders.",
        "commands.study:serve_app",
        ("notchbend app", "notchbend app --rig mine.toml --amplitude 2 --record bench.csv"),
    ),
}
DATA_COMMANDS: dict[str, Entry] = {
    "list": Entry("List records that can be fetched.", "commands.data:list_records", ("notchbend data list",)),
    "fetch": Entry(
        "Fetch one record.", "commands.data:fetch", ("notchbend data fetch notched-wrist-90 --out measured",)
    ),
}
RECORD_COMMANDS: dict[str, Entry] = {
    "new": Entry(
        "Make a record of a table from the bench.",
        "own_rig.commands:record_new",
        (
            "notchbend record new bench.csv --rig mine.toml --preload 20",
            "notchbend record new bench.csv --drive-column stroke --angle-column bend --drive-unit mm",
            "notchbend record new bench.xlsx --sheet 2 --angle-unit rad --out bench-record.csv",
        ),
    ),
}
PRACTICE_COMMANDS: dict[str, Entry] = {
    "export": Entry(
        "Write blind cases.", "commands.practice:export", ("notchbend practice export --count 4 --seed 7 --out cases",)
    ),
    "answer": Entry(
        "Answer cases.", "commands.practice:answer", ("notchbend practice answer cases --by tracer --workers 2",)
    ),
    "score": Entry(
        "Score answers.",
        "commands.practice:score",
        ("notchbend practice score cases cases-ANSWERS.json --out score.json",),
    ),
}


class OnDemand(Mapping[str, Any]):
    """Commands by name: a command is imported when it is called, a group at once."""

    def __init__(self, entries: Mapping[str, Entry], groups: Mapping[str, Any]) -> None:
        self._entries, self._groups = entries, dict(groups)

    def __getitem__(self, name: str) -> Any:
        """Import a command and make its options; a KeyError for an unknown name."""
        if name in self._entries:
            with stoppable():  # imports take a second
                return command_of(name, self._entries[name])
        return self._groups[name]

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a command or a group of this name."""
        return name in self._entries or name in self._groups

    def __iter__(self) -> Iterator[str]:
        """Give the names in the order of the declaration."""
        return iter([*self._entries, *self._groups])

    def __len__(self) -> int:
        """Count commands and groups."""
        return len(self._entries) + len(self._groups)


class Commands(TyperGroup):
    """Commands that are imported when they are called; the list of commands has their summaries."""

    entries: ClassVar[Mapping[str, Entry]] = COMMANDS

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.groups = dict(self.commands)
        self.commands = OnDemand(self.entries, self.groups)  # type: ignore[assignment]

    def resolve_command(self, ctx: typer.Context, args: list[str]) -> Any:  # type: ignore[override]
        """Find the command that the arguments begin with; an unknown one is an error that lists those there are."""
        if args[0] not in self.commands:
            ctx.fail(f"{args[0]}: no such command: expected one of {', '.join(self.commands)}")
        return super().resolve_command(ctx, args)

    def list_commands(self, ctx: typer.Context) -> list[str]:  # type: ignore[override]
        """Give the names, in the order of the declaration."""
        return list(self.commands)

    def format_commands(self, ctx: typer.Context, formatter: Any) -> None:  # type: ignore[override]
        """List the commands without importing them."""
        groups = ((name, group.get_short_help_str()) for name, group in self.groups.items())
        with formatter.section("Commands"):
            formatter.write_dl([*((name, entry.summary) for name, entry in self.entries.items()), *groups])


class DataCommands(Commands):
    """``notchbend data``."""

    entries = DATA_COMMANDS


class RecordCommands(Commands):
    """``notchbend record``."""

    entries = RECORD_COMMANDS


class PracticeCommands(Commands):
    """``notchbend practice``."""

    entries = PRACTICE_COMMANDS


def command_of(name: str, entry: Entry) -> TyperCommand:
    """Import a command, and make its options and its help."""
    from studies.commands.options import COMMAND, with_option_groups

    command = with_option_groups(entry.load())

    @functools.wraps(command)
    def run(*, context: typer.Context, **given: Any) -> None:
        with stoppable():
            command(**given, **{COMMAND: _command_line(context.obj or (), given)})

    own = inspect.Parameter("context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context)
    run.__signature__ = inspect.Signature([own, *inspect.signature(command).parameters.values()])  # type: ignore[attr-defined]
    run.__annotations__ = {**run.__annotations__, "context": typer.Context}
    alone = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    examples = "\n".join(["\b", "Examples:", *(f"  {line}" for line in entry.examples)])
    alone.command(name, epilog=examples)(run)
    return typer.main.get_command(alone)  # type: ignore[return-value]


def _command_line(arguments: Sequence[str], given: Mapping[str, Any]) -> str:
    """Give a command line for a shell, without the options that change no result; empty where there are no arguments.

    Bytes of a name that are not UTF-8 are shown as escapes: no page can hold them.
    """
    dropped = {option for name, option in NOT_OF_RESULTS.items() if given.get(name)}
    words = [one.encode("utf-8", "backslashreplace").decode() for one in arguments if one not in dropped]
    return shlex.join(["notchbend", *words]) if arguments else ""


app = typer.Typer(cls=Commands, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
GROUPS = {
    "data": (DataCommands, "Measured records from public repositories."),
    "record": (RecordCommands, "Records from your own bench."),
    "practice": (PracticeCommands, "A benchmark that others can take."),
}
for group, (listed, about) in GROUPS.items():
    app.add_typer(typer.Typer(cls=listed, rich_markup_mode=None), name=group, help=about)


def _show_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        typer.echo(f"notchbend {version('notchbend')}")
        raise typer.Exit


@app.callback(help=__doc__, epilog="Options and examples of a command: notchbend COMMAND --help")
def _top(
    show_version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_show_version, help="Show the version and exit.")
    ] = False,
) -> None: ...


def call(arguments: Sequence[str]) -> int:
    """Run a command line and return the exit code.

    Bad input and usage errors are reported in one line and give 2; Ctrl-C gives 130 and SIGTERM 143. Without a command
    the help is shown, and the code is 2.
    """
    if not arguments or list(arguments) in [[name] for name in GROUPS]:
        call([*arguments, "--help"])
        return BAD_INPUT
    try:
        found = app(args=one_value_each(arguments), standalone_mode=False, prog_name="notchbend", obj=tuple(arguments))
    except StoppedError as stop:
        return end(stop)
    except Exception as error:
        stopped = asked_to_stop()
        if stopped is not None:
            return end(stopped)
        usage = getattr(error, "format_message", None)  # errors of the command line library
        if usage is not None:
            return _complain(_with_value(str(usage()), arguments))
        if isinstance(error, OSError) and error.strerror:
            file = error.filename or _unnamed_file(error)
            return _complain(f"{file}: {error.strerror}" if file else error.strerror)
        if isinstance(error, _errors_of_input()):
            return _complain("; ".join([str(error), *getattr(error, "__notes__", ())]))
        raise
    if found == StoppedError(KeyboardInterrupt()).code and (stopped := asked_to_stop()):
        return end(stopped)  # between commands the library gives this code, without a word
    return found if isinstance(found, int) else 0


def _unnamed_file(error: OSError) -> str:
    """Say what an error that names no file is of: numba does not say which file of its cache it could not write."""
    modules = {frame.f_globals.get("__name__") for frame, _ in traceback.walk_tb(error.__traceback__)}
    return "a file of the cache of compiled kernels" if "numba.core.caching" in modules else ""


def _errors_of_input() -> tuple[type[Exception], ...]:
    """Give the errors that a user's input can cause; imported only when there is an error."""
    from fem_models.rig import RigError
    from fem_models.rig.checks import SolverError
    from hysteresis.records.record import RecordError
    from studies.engines import MissingError
    from studies.sweep.errors import StudyError

    return RecordError, StudyError, RigError, SolverError, MissingError, OSError


def one_value_each(arguments: Sequence[str]) -> list[str]:
    """Give the arguments with one value an option: references of a trace and preloads of a run may be several."""
    return _repeated(_repeated(arguments, "trace", "--reference"), "run", "--preload", _is_number)


def _repeated(
    arguments: Sequence[str], command: str, option: str, is_value: Callable[[str], bool] = lambda word: True
) -> list[str]:
    """Repeat an option of a command before each of its values: ``--option a b`` becomes ``--option a --option b``.

    The command line library takes one value an option. Values end at the next option, or at a word that is none.
    """
    if not arguments or arguments[0] != command:
        return list(arguments)
    out, inside = list[str](), False
    for one in arguments:
        if one.startswith("-"):
            inside = one == option or one.startswith(f"{option}=")
        elif inside and out[-1] != option:
            inside = is_value(one)
            out += [option] if inside else []
        out.append(one)
    return out


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _with_value(message: str, arguments: Sequence[str]) -> str:
    """Add the value that was given, which the library's message leaves out."""
    for option, value in pairwise(arguments):
        if option.startswith("--") and f"'{option}'" in message and value not in message:
            return f"{message.rstrip('.')}: {option} {value}"
    return message


def _complain(message: str, code: int = BAD_INPUT) -> int:
    from hysteresis.messages import one_line

    print("notchbend: " + one_line(message), file=sys.stderr)  # noqa: T201
    return code


def main() -> None:
    """Run the command line of this process."""
    watch()
    for stream in (sys.stdout, sys.stderr):  # where the locale has no such character: an escape, not an error
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        with stoppable():  # also before a command begins, and after it ends
            code = call(sys.argv[1:])
    except StoppedError as stop:
        code = end(stop)
    leave(code)
