"""The compensator as a unit of co-simulation, FMI 2.0 and 3.0: source, model description, and a binary."""

from __future__ import annotations

import io
import platform
import shutil
import subprocess
import sys
import uuid
import zipfile
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal
from xml.sax.saxutils import quoteattr

import numpy as np

from hysteresis.files import RecordError
from hysteresis.messages import quoted
from hysteresis.own import MAKER
from studies.firmware.about import about, package_version
from studies.firmware.files import compensator_files, filled
from studies.firmware.read import Compensator

Version = Literal["2.0", "3.0"]
OPTIONS = ("-std=c99", "-O2", "-fPIC", "-shared", "-fvisibility=hidden")
COMPILERS = ("cc", "gcc", "clang")
_DAY = (1980, 1, 1, 0, 0, 0)  # of every file in the archive: the same fit gives the same unit
_SYSTEMS = {"linux": ("linux", ".so"), "darwin": ("darwin", ".dylib"), "win32": ("windows", ".dll")}
_MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}
_FMI_2 = {
    "x86_64-linux": "linux64",
    "x86_64-darwin": "darwin64",
    "aarch64-darwin": "darwin64",
    "x86_64-windows": "win64",
}


@dataclass(frozen=True)
class Variable:
    """A variable of the unit; its place in :func:`variables` is its reference in ``c/unit.c``."""

    name: str
    kind: Literal["Real", "Integer", "Boolean"]
    causality: Literal["independent", "input", "output", "parameter"]
    words: str


def variables(unit: str, delay_s: float = 0.0) -> tuple[Variable, ...]:
    """Give the variables for a unit of the drive, and a delay of the angle behind it."""
    later = f", {delay_s:.3g} s from now" if delay_s > 0 else ""
    return (
        Variable("time", "Real", "independent", "s"),
        Variable("reference_deg", "Real", "input", f"wanted angle{later}"),
        Variable("measured_deg", "Real", "input", "measured angle at the drive of the last step"),
        Variable(f"largest_step_{unit}", "Real", "parameter", "largest change of the drive in a step; 0 for none"),
        Variable(f"drive_{unit}", "Real", "output", "drive that makes the angle the reference"),
        Variable("angle_deg", "Real", "output", "angle of the model at the drive"),
        Variable("zero_deg", "Real", "output", "offset that was learnt"),
        Variable("gain", "Real", "output", "factor on f that was learnt"),
        Variable("width", "Real", "output", "factor on the saturation of h that was learnt"),
        Variable("limited", "Integer", "output", "bits: 1 lowest drive, 2 highest drive, 4 rate, 8 not finite"),
        Variable("flags", "Integer", "output", "bits: 1 not excited, 2 at a bound, 4 outside the fit, 8 not finite"),
        Variable("reidentify", "Boolean", "parameter", "learn from measured_deg"),
    )


def unit_files(compensator: Compensator, out: Path, *, seed: int = 0) -> dict[Path, bytes]:
    """Give ``NAME.fmu``, FMI 3.0, and ``NAME_fmi2.fmu``, FMI 2.0, by their paths in a folder.

    The binary is made by the C compiler of this machine (cc, gcc or clang); without one the units hold their source
    alone.

    Raises
    ------
    RecordError
        A constant that is not finite, or a compiler that fails.
    """
    made = compensator_files(compensator, out, seed=seed)
    sources = {path.name: text for path, text in made.items() if path.suffix in (".c", ".h")}
    return {
        out / f"{compensator.name}.fmu": _unit(compensator, sources, "3.0"),
        out / f"{compensator.name}_fmi2.fmu": _unit(compensator, sources, "2.0"),
    }


def _unit(compensator: Compensator, sources: dict[str, str], version: Version) -> bytes:
    name, major = compensator.name, version[0]
    token = f"{{{uuid.uuid5(uuid.NAMESPACE_URL, f'{MAKER}/{compensator.checksum}/{name}/{version}')}}}"
    wrapper = f"{name}_fmi{major}.c"
    values = {"name": name, "version": package_version(), "token": token}
    every = {**sources, wrapper: filled(f"fmi{major}.c", {**values, "unit": filled("unit.c", values)})}
    files: dict[str, bytes] = {"modelDescription.xml": _description(compensator, token, wrapper, version).encode()}
    files |= {f"sources/{key}": text.encode() for key, text in every.items()}
    if version == "3.0":
        files["sources/buildDescription.xml"] = _build_description(name, wrapper).encode()
    if (binary := _binary(name, every, wrapper, version)) is not None:
        files |= binary
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.comment = f"made by {MAKER}".encode()
        for key, content in files.items():
            entry = zipfile.ZipInfo(key, _DAY)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, content)
    return file.getvalue()


def compiler_here() -> str | None:
    """Find the C compiler of this machine, the first of cc, gcc and clang; None without one."""
    return next((found for one in COMPILERS if (found := shutil.which(one))), None)


def _binary(name: str, sources: dict[str, str], wrapper: str, version: Version) -> dict[str, bytes] | None:
    """Compile the unit for this machine; None without a compiler, or where the standard has no name for the machine."""
    compiler = compiler_here()
    system, machine = _SYSTEMS.get(sys.platform), _MACHINES.get(platform.machine().lower())
    if compiler is None or system is None or machine is None:
        return None
    place: str | None = f"{machine}-{system[0]}"
    if version == "2.0":
        place = _FMI_2.get(f"{machine}-{system[0]}")
    if place is None:
        return None
    with TemporaryDirectory() as folder:
        for key, text in sources.items():
            (Path(folder) / key).write_text(text, encoding="utf-8")
        library = f"{name}{system[1]}"
        command = [compiler, *OPTIONS, f"{name}.c", wrapper, "-o", library, "-lm"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode:
            said = " ".join(done.stderr.split())
            raise RecordError(f"{compiler}: the C compiler could not make the unit: {quoted(said, 200)}")
        return {f"binaries/{place}/{library}": (Path(folder) / library).read_bytes()}


def _start(compensator: Compensator) -> float:
    layer = compensator.layer
    f = layer.f(np.array([layer.first_drive]))
    return float((f + sum(one.along(f) for one in layer.elements))[0])


def _description(compensator: Compensator, token: str, wrapper: str, version: Version) -> str:
    name, many = compensator.name, variables(compensator.unit, compensator.layer.delay_s)
    words = " ".join(about(compensator).split())
    head = f'modelName={quoteattr(name)} description={quoteattr(words)} generationTool="{MAKER} {package_version()}"'
    start = {"Real": repr(_start(compensator)), "Boolean": "false", "Integer": "0"}
    outputs = [k for k, one in enumerate(many) if one.causality == "output"]
    lines = ['<?xml version="1.0" encoding="UTF-8"?>']
    state = f'modelIdentifier="{name}" canHandleVariableCommunicationStepSize="true"'
    if version == "2.0":
        kept = 'canGetAndSetFMUstate="true" canSerializeFMUstate="true"'
        lines += [
            f'<fmiModelDescription fmiVersion="2.0" guid="{token}" {head}>',
            f"<CoSimulation {state} {kept}><SourceFiles>",
            f'<File name="{name}.c"/><File name="{wrapper}"/></SourceFiles></CoSimulation>',
            "<ModelVariables>",
        ]
        for k, one in enumerate(many):
            lines.append(_scalar_2(k, one, start[one.kind] if one.name.endswith(("ence_deg", "ured_deg")) else None))
        unknowns = "".join(f'<Unknown index="{k + 1}"/>' for k in outputs)
        lines.append("</ModelVariables><ModelStructure>")
        lines.append(f"<Outputs>{unknowns}</Outputs><InitialUnknowns>{unknowns}</InitialUnknowns>")
    else:
        kept = 'canGetAndSetFMUState="true" canSerializeFMUState="true"'
        lines += [
            f'<fmiModelDescription fmiVersion="3.0" instantiationToken="{token}" {head}>',
            f"<CoSimulation {state} {kept}/>",
            "<ModelVariables>",
        ]
        for k, one in enumerate(many):
            lines.append(_scalar_3(k, one, start[one.kind] if one.name.endswith(("ence_deg", "ured_deg")) else None))
        unknowns = "".join(f'<Output valueReference="{k}"/>' for k in outputs)
        lines.append("</ModelVariables><ModelStructure>")
        lines.append(unknowns + unknowns.replace("<Output ", "<InitialUnknown "))
    return "\n".join([*lines, "</ModelStructure></fmiModelDescription>"]) + "\n"


def _start_of(one: Variable, angle: str | None) -> str:
    if one.causality == "input":
        return f' start="{angle}"'
    if one.causality == "parameter":
        return ' start="false"' if one.kind == "Boolean" else ' start="0"'
    return ""


def _scalar_2(reference: int, one: Variable, angle: str | None) -> str:
    changes = {"parameter": "tunable"}.get(one.causality, "discrete")
    if one.causality == "independent":
        changes = "continuous"
    initial = ' initial="calculated"' if one.causality == "output" else ""
    return (
        f'<ScalarVariable name="{one.name}" valueReference="{reference}" causality="{one.causality}" '
        f'variability="{changes}"{initial} description={quoteattr(one.words)}>'
        f"<{one.kind}{_start_of(one, angle)}/></ScalarVariable>"
    )


def _scalar_3(reference: int, one: Variable, angle: str | None) -> str:
    kind = {"Real": "Float64", "Integer": "Int32", "Boolean": "Boolean"}[one.kind]
    changes = {"parameter": "tunable", "independent": "continuous"}.get(one.causality, "discrete")
    initial = ' initial="calculated"' if one.causality == "output" else ""
    return (
        f'<{kind} name="{one.name}" valueReference="{reference}" causality="{one.causality}" '
        f'variability="{changes}"{initial} description={quoteattr(one.words)}{_start_of(one, angle)}/>'
    )


def _build_description(name: str, wrapper: str) -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'<BuildConfiguration modelIdentifier="{name}"><SourceFileSet language="C99">'
        f'<SourceFile name="{name}.c"/><SourceFile name="{wrapper}"/></SourceFileSet></BuildConfiguration>\n'
        "</fmiBuildDescription>\n"
    )
