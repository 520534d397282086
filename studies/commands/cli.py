"""The command line notchbend. Bad input: one line on standard error and exit code 2, and no incomplete files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from itertools import pairwise

import typer

from fem_models.rig import RigError
from fem_models.rig.checks import SolverError
from hysteresis.messages import one_line
from hysteresis.record import RecordError
from studies.commands.data import fetch, list_records
from studies.commands.options import with_option_groups
from studies.commands.practice import answer, export, score
from studies.commands.records import compensate, effects, identify, separate, trace
from studies.commands.simulation import run, simulate, validate
from studies.commands.study import report, serve_app, study
from studies.engines import MissingError
from studies.sweep import StudyError

app = typer.Typer(
    no_args_is_help=True, add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, help=__doc__
)
data_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="Measured records from public repositories.")
practice_app = typer.Typer(no_args_is_help=True, rich_markup_mode=None, help="A benchmark that others can take.")

COMMANDS: dict[str, Callable[..., None]] = {
    "run": run,
    "simulate": simulate,
    "validate": validate,
    "identify": identify,
    "separate": separate,
    "trace": trace,
    "effects": effects,
    "compensate": compensate,
    "study": study,
    "report": report,
    "app": serve_app,
}
DATA_COMMANDS: dict[str, Callable[..., None]] = {"list": list_records, "fetch": fetch}
PRACTICE_COMMANDS: dict[str, Callable[..., None]] = {"export": export, "answer": answer, "score": score}
for typer_app, commands in ((app, COMMANDS), (data_app, DATA_COMMANDS), (practice_app, PRACTICE_COMMANDS)):
    for name, command in commands.items():
        typer_app.command(name)(with_option_groups(command))
app.add_typer(data_app, name="data")
app.add_typer(practice_app, name="practice")

INTERRUPTED = 130  # 128 + SIGINT, as in shells
BAD_INPUT = (RecordError, StudyError, RigError, SolverError, MissingError, OSError)


def call(arguments: Sequence[str]) -> int:
    """Run a command line and return the exit code.

    Bad input and usage errors are reported in one line and give 2; Ctrl-C gives 130.
    """
    try:
        code = app(args=repeated(arguments, "trace", "--reference"), standalone_mode=False, prog_name="notchbend")
    except (KeyboardInterrupt, typer.Abort):
        code = INTERRUPTED
    except BAD_INPUT as error:
        if isinstance(error, OSError) and error.strerror:
            return _complain(f"{error.filename}: {error.strerror}")
        return _complain(str(error))
    except Exception as error:
        usage = getattr(error, "format_message", None)  # errors of the command line library
        if usage is None:
            raise
        return _complain(_with_value(str(usage()), arguments))
    if code == INTERRUPTED:  # the library turns KeyboardInterrupt into this exit code, without a message
        return _complain("interrupted", INTERRUPTED)
    return code if isinstance(code, int) else 0


def repeated(arguments: Sequence[str], command: str, option: str) -> list[str]:
    """Repeat an option of a command before each of its values: ``--option a b`` becomes ``--option a --option b``.

    The command line library takes one value an option. A value ends at the next option.
    """
    if not arguments or arguments[0] != command:
        return list(arguments)
    out, inside = list[str](), False
    for one in arguments:
        if inside and not one.startswith("-") and out[-1] != option:
            out.append(option)
        elif one.startswith("-"):
            inside = one == option
        out.append(one)
    return out


def _with_value(message: str, arguments: Sequence[str]) -> str:
    """Add the value that was given, which the library's message leaves out."""
    for option, value in pairwise(arguments):
        if option.startswith("--") and f"'{option}'" in message and value not in message:
            return f"{message.rstrip('.')}: {option} {value}"
    return message


def _complain(message: str, code: int = 2) -> int:
    print("notchbend: " + one_line(message), file=sys.stderr)  # noqa: T201
    return code


def main() -> None:
    """Run the command line of this process."""
    sys.exit(call(sys.argv[1:]))
