"""Groups of command line options as frozen dataclasses, and the decorator that makes Typer options of their fields.

A command takes a group as one parameter; a user sees the options of its fields::

    @dataclass(frozen=True)
    class Output:
        quiet: Annotated[bool, typer.Option("--quiet", help="...")] = False

    @with_option_groups
    def simulate(out: Annotated[Path, typer.Option("--out")], output: Output) -> None: ...
"""

from __future__ import annotations

import functools
import inspect
import json
from collections.abc import Callable, Iterable
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_type_hints

import typer
from rich.console import Console
from rich.table import Table

from fem_models.load import LoadProgram, sine, triangle
from fem_models.rig import Rig, RigError, ensemble, preset, read_rig
from fem_models.rig.presets import NAMES_IN_SPACE, PRESETS
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig_file import read_any_rig
from hysteresis.arrays import Floats
from hysteresis.files import require_place
from hysteresis.own import foreign, marked_values
from hysteresis.plain import to_plain
from hysteresis.records.record import RecordError
from studies.programs import forces_of_file, program_of_file, wheels_of_file

if TYPE_CHECKING:
    from fem_models.spatial.drives import WheelProgram
    from studies.report.page import Written

Out = Annotated[Path, typer.Option("--out", help="Folder for the results; made if it does not exist.")]
Records = Annotated[list[Path], typer.Argument(help="The records, CSV.")]
ALL = (*PRESETS, *NAMES_IN_SPACE)
"""Names of the presets; those of rigs in space are for commands that know them, and the others say so."""
COMMAND = "command"
"""Field of a group that is no option: the command as it was given."""


def with_option_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Replace each parameter whose type is a dataclass by an option for each of its fields.

    Typer reads the signature that this sets. The fields' annotations say what the options are, and their defaults what
    the options' defaults are. The command is called with the dataclasses, made of what the user gave. Groups with a
    field :data:`COMMAND` get what is passed under this name, an empty text by default.

    Raises
    ------
    TypeError
        Two options of the same name, when the command is declared.
    """
    hints = get_type_hints(command, include_extras=True)
    parameters = inspect.signature(command).parameters
    groups = {name: hints[name] for name in parameters if is_dataclass(hints[name])}
    shown: list[inspect.Parameter] = []
    for name, parameter in parameters.items():
        if name in groups:
            shown += _options_of(groups[name])
        else:
            shown.append(parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[name]))
    names = [one.name for one in shown]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise TypeError(f"{command.__name__}: option {twice} is in two groups")

    @functools.wraps(command)
    def run(**given: Any) -> None:
        line = given.pop(COMMAND, "")
        made = {}
        for name, group in groups.items():
            values = {one.name: given.pop(one.name) for one in _option_fields(group)}
            made[name] = group(**values, **({COMMAND: line} if COMMAND in group.__dataclass_fields__ else {}))
        command(**made, **given)

    run.__signature__ = inspect.Signature(shown)  # type: ignore[attr-defined]
    run.__annotations__ = {one.name: one.annotation for one in shown}
    return run


def _option_fields(group: type) -> list[Field[Any]]:
    return [one for one in fields(group) if one.name != COMMAND]


def _options_of(group: type) -> list[inspect.Parameter]:
    """Give a parameter for each field of a group; a field without a default is a required option."""
    hints = get_type_hints(group, include_extras=True)
    return [
        inspect.Parameter(
            one.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if one.default is MISSING else one.default,
            annotation=hints[one.name],
        )
        for one in _option_fields(group)
    ]


@dataclass(frozen=True)
class Seed:
    """The seed, which every command takes."""

    seed: Annotated[int, typer.Option("--seed", min=0, help="Seed of all random numbers.")] = 0


@dataclass(frozen=True)
class Output:
    """What is printed; ``command`` is the command as it was given, empty in a call from Python."""

    quiet: Annotated[bool, typer.Option("--quiet", help="Print no progress and no summary.")] = False
    json: Annotated[bool, typer.Option("--json", help="Print the result as JSON on standard output.")] = False
    command: str = field(default="", compare=False)

    @property
    def shows_progress(self) -> bool:
        """Whether progress is shown, on a terminal."""
        return not self.quiet and not self.json

    def show(self, result: object, *parts: str | Table) -> None:
        """Print the result as JSON, or tables and lines for a reader, or nothing."""
        if self.json:
            typer.echo(json.dumps(marked_values(to_plain(result, finite=False)), indent=2))
        elif not self.quiet:
            console = Console()
            for number, part in enumerate(parts):
                if number and isinstance(part, Table):
                    console.print()
                console.print(part, soft_wrap=isinstance(part, str), highlight=False, markup=False)

    def show_with_page(self, result: object, written: Written, *parts: str | Table) -> None:
        """Print as :meth:`show`, and where the page is; of one that could not be made a line on standard error."""
        if written.page is None:
            typer.echo(f"notchbend: {written.line}", err=True)
            self.show(result, *parts)
        else:
            self.show(result, *parts, written.line)


@dataclass(frozen=True)
class Common(Output, Seed):
    """Options of every command: --seed, --quiet, --json."""


@dataclass(frozen=True)
class Overwrite:
    """Whether files are replaced that another program wrote, or a hand."""

    force: Annotated[
        bool, typer.Option("--force", help="Replace files that notchbend did not write, and name them.")
    ] = False

    def allow(self, paths: Iterable[Path]) -> None:
        """Check the files that a command is about to write, before it computes anything.

        Raises
        ------
        RecordError
            One that is there without the mark of notchbend, and no --force; with it a line on standard error names it.
            A folder that cannot be written to.
        """
        targets = list(paths)
        for path in targets:
            require_place(path)
        for path in foreign(targets):
            if not self.force:
                raise RecordError(f"{path}: not written by notchbend: expected another --out, or --force to replace it")
            typer.echo(f"notchbend: --force: {path} is replaced, which notchbend did not write", err=True)


@dataclass(frozen=True)
class RigChoice:
    """A rig: a preset or a file, with its own preload or another."""

    preset: Annotated[str | None, typer.Option("--preset", help=f"One of {', '.join(ALL)}; or --rig.")] = None
    rig: Annotated[Path | None, typer.Option("--rig", help="A rig file, TOML, in place of --preset.")] = None
    preload: Annotated[
        float | None, typer.Option("--preload", help="Preload of the tendons, N; by default that of the rig.")
    ] = None

    def read(self) -> Rig:
        """Give the rig, of one plane.

        Raises
        ------
        RigError
            Neither a preset nor a file, or both; a rig that cannot be read, or that bends in space.
        """
        return self._read(preset, read_rig)

    def read_any(self) -> Rig:
        """Give the rig, of one plane or in space.

        Raises
        ------
        RigError
            As :meth:`read`.
        """
        return self._read(any_preset, read_any_rig)

    def _read(self, of_preset: Callable[..., Rig], of_file: Callable[[Path], Rig]) -> Rig:
        if (self.preset is None) == (self.rig is None):
            raise RigError("expected either --preset or --rig")
        if self.preset is not None:
            return possible(of_preset(self.preset, preload_N=self.preload))
        assert self.rig is not None
        return possible(of_file(self.rig).with_preload(self.preload))


def possible(rig: Rig) -> Rig:
    """Give a rig, but for one whose preload breaks a tendon or buckles the tube.

    What a preload of a single tendon does depends on the program: a tendon force takes its place. The engines check it.

    Raises
    ------
    RigError
        From :mod:`fem_models.joint.possible`.
    """
    from fem_models.joint import joint_row
    from fem_models.joint.possible import require_possible, require_strain

    require_strain(rig.in_plane)
    if rig.is_planar and rig.tendon_b is not None:
        require_possible(rig, joint_row(rig))
    return rig


@dataclass(frozen=True)
class EnsembleChoice:
    """Whether a command runs over the ensemble of the preset too."""

    ensemble: Annotated[
        bool, typer.Option("--ensemble", help="Also give 90 % ranges over the ensemble of the preset.")
    ] = False

    def members(self, rig: RigChoice) -> tuple[Rig, ...]:
        """Give the members of the preset's ensemble, at the preload of the choice; none without --ensemble.

        Raises
        ------
        RigError
            A rig from a file, or a preset without an ensemble.
        """
        if not self.ensemble:
            return ()
        if rig.preset is None:
            raise RigError(f"--ensemble with --rig {rig.rig}: expected --preset")
        return ensemble(rig.preset, preload_N=rig.preload)

    def require_off(self, what: str) -> None:
        """Refuse --ensemble where it has no meaning.

        Raises
        ------
        RigError
            --ensemble was given.
        """
        if self.ensemble:
            raise RigError(f"--ensemble with {what}: expected --preset")


@dataclass(frozen=True)
class ProgramChoice:
    """A load program: from a file, or a triangle or a sine of a given amplitude."""

    amplitude: Annotated[
        float | None, typer.Option("--amplitude", help="Amplitude of the drive, mm; or --program.")
    ] = None
    cycles: Annotated[
        int | None, typer.Option("--cycles", help="Closed cycles after the first loading branch; by default 1.")
    ] = None
    step: Annotated[
        float | None, typer.Option("--step", help="Step of a point-by-point program, mm; by default 0.1.")
    ] = None
    rate: Annotated[
        float | None, typer.Option("--rate", help="Frequency of a sine, Hz, in place of a point-by-point program.")
    ] = None
    program: Annotated[
        Path | None,
        typer.Option(
            "--program",
            help="In place of --amplitude: CSV of drive_mm and, if any, time_s; or tendon_force_N. In space "
            "drive_1_mm, drive_2_mm, or tension_1_N to tension_4_N.",
        ),
    ] = None
    circle: Annotated[
        bool, typer.Option("--circle", help="All wheels once round, at --amplitude; of a rig in space.")
    ] = False

    def read(self) -> LoadProgram:
        """Read or make the program.

        Raises
        ------
        RigError, RecordError
            Options that exclude each other, or a file that cannot be read; --circle, which is of a rig in space.
        """
        if self.circle:
            raise RigError("--circle: both wheels of a rig in space: expected --amplitude alone of a planar rig")
        if self.program is not None:
            self._require_alone(self.program)
            return program_of_file(self.program)
        cycles = 1 if self.cycles is None else self.cycles
        if self.amplitude is None:
            raise RigError("expected either --amplitude or --program")
        if self.rate is None:
            return triangle(self.amplitude, step_mm=0.1 if self.step is None else self.step, cycles=cycles)
        if self.step is not None:
            raise RigError(
                f"--step {self.step}: of a point-by-point program, --rate {self.rate} makes a sine: "
                "expected one of the two"
            )
        return sine(self.amplitude, self.rate, cycles=cycles)

    def in_space(self, rig: Rig) -> WheelProgram:
        """Read or make the program of a rig in space: a planar program moves the first wheel.

        Raises
        ------
        RigError, RecordError
            As :meth:`read`; a circle of a rig that has not two wheels.
        """
        from fem_models.spatial.drives import circle, first_wheel, round_axes

        if self.program is not None:
            self._require_alone(self.program)
            return wheels_of_file(self.program)
        if not self.circle:
            return first_wheel(self.read(), rig)
        if rig.wheel_count < 2:
            raise RigError(f"--circle: rig {rig.name} has one wheel: expected 2 to 4")
        if self.amplitude is None or self.rate is not None:
            raise RigError("--circle: expected --amplitude, and no --rate")
        cycles = 1 if self.cycles is None else self.cycles
        step = 0.1 if self.step is None else self.step
        return circle(self.amplitude, step_mm=step, cycles=cycles, axes=round_axes(rig))

    def forces(self) -> Floats | None:
        """Read the tensions at the wheel, N, shape (m,); None for a program in mm, which :meth:`read` gives.

        Raises
        ------
        RigError, RecordError
            Options that exclude each other, or a file that cannot be read.
        """
        if self.program is None:
            return None
        self._require_alone(self.program)
        return forces_of_file(self.program)

    def _require_alone(self, program: Path) -> None:
        for name in ("amplitude", "rate", "step", "cycles", "circle"):
            if (value := getattr(self, name)) not in (None, False):
                raise RigError(f"--{name} {value}: --program {program} has the whole program: expected one of the two")
