"""CalculiX, an independent code, on the same mesh: stiffness and large bending of one single notched ring (SNR).

CalculiX (``ccx``) is a separate program, free software, https://www.calculix.de; Debian has it as ``calculix-ccx``.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import meshio
import numpy as np

from fem_models.solid.linear import Solid, cells, end_nodes, rigid_motions
from hysteresis.arrays import Floats, Ints

TIME_LIMIT_S = 600.0

_NUMBER = ".12e"  # CalculiX reads the first 20 characters of a number


class CalculixError(RuntimeError):
    """CalculiX is not installed or gave no result; the message is one line with the reason."""


def calculix_stiffness(solid: Solid, *, program: str = "ccx") -> Floats:
    """Stiffness (6, 6) between rigid end plates, N, mm, rad; see :class:`fem_models.solid.linear.SnrStiffness`.

    Six linear steps prescribe the displacements of all nodes of both end faces; the stiffness is the work of their
    reaction forces. Elements are C3D10, which CalculiX integrates with four points.

    Raises
    ------
    CalculixError
        If the program is missing, fails, or leaves no reaction forces.
    """
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "snr.inp"
        write_input(solid, job)
        forces = _reactions(job, program, steps=6)
    return np.asarray(np.einsum("nai,sna->is", _end_motions(solid), forces))


def calculix_forces(
    points_mm: Floats,
    tetrahedra: Ints,
    young_MPa: float,
    poisson: float,
    prescribed_mm: Floats,
    *,
    plateau_MPa: tuple[tuple[float, float], ...] = (),
    program: str = "ccx",
) -> Floats:
    """Nodal forces (k, 3), N, on the k nodes with a prescribed large displacement (NLGEOM).

    The metal is elastic after Saint Venant and Kirchhoff. With ``plateau_MPa``, pairs of stress and plastic strain, it
    yields after von Mises, with isotropic hardening.

    Parameters
    ----------
    prescribed_mm
        Displacements (n, 3), nan where free.

    Raises
    ------
    CalculixError
        As :func:`calculix_stiffness`.
    """
    nodes = np.flatnonzero(np.isfinite(prescribed_mm).any(axis=1))
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "large.inp"
        lines = _head(points_mm, tetrahedra, nodes, young_MPa, poisson, job)
        if plateau_MPa:
            rows = [f"{stress:{_NUMBER}}, {strain:{_NUMBER}}" for stress, strain in plateau_MPa]
            lines[-1:-1] = ["*PLASTIC", *rows]
        lines += ["*STEP, NLGEOM, INC=400", "*STATIC", "0.1, 1.0, 1e-5, 0.1", "*BOUNDARY"]
        for node in nodes:
            values = enumerate(prescribed_mm[node], start=1)
            lines += [f"{node + 1}, {axis}, {axis}, {value:{_NUMBER}}" for axis, value in values if np.isfinite(value)]
        lines += ["*NODE PRINT, NSET=ENDS, FREQUENCY=400", "RF", "*END STEP"]
        job.write_text("\n".join(lines) + "\n")
        return _reactions(job, program, steps=1)[0]


def _reactions(job: Path, program: str, *, steps: int) -> Floats:
    """Run CalculiX on an input file and read the forces that it printed."""
    found = shutil.which(program)
    if found is None:
        raise CalculixError(f"{program}: expected the program of CalculiX on the path")
    environment = {"OMP_NUM_THREADS": str(os.cpu_count() or 1), **os.environ}
    command = [found, "-i", job.stem]
    try:
        done = subprocess.run(
            command, cwd=job.parent, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False, env=environment
        )
    except subprocess.TimeoutExpired:
        raise CalculixError(f"{program} did not end within {TIME_LIMIT_S:g} s") from None
    results = job.with_suffix(".dat")
    if done.returncode or not results.exists():
        errors = [line for line in done.stdout.splitlines() if "ERROR" in line] or ["no results"]
        raise CalculixError(f"{program} failed with exit code {done.returncode}: {errors[0].strip()[:200]}")
    return read_reactions(results, steps=steps)


def _head(points: Floats, tetrahedra: Ints, nodes: Ints, young_MPa: float, poisson: float, path: Path) -> list[str]:
    """Lines before the steps; writes the mesh into a second file next to ``path``. ``nodes`` count from 0."""
    mesh_file = path.with_name(f"{path.stem}-mesh.inp")
    sets = {"METAL": [np.arange(len(tetrahedra), dtype=np.int64)]}
    mesh = meshio.Mesh(points, [("tetra10", tetrahedra)], cell_sets=sets)
    mesh.write(mesh_file, file_format="abaqus", float_fmt=_NUMBER)
    # meshio knows several ten-node elements of this format and names the last of them, a hybrid that CalculiX lacks
    mesh_file.write_text(re.sub(r"TYPE=C3D10\w*", "TYPE=C3D10", mesh_file.read_text()))
    return [
        f"*INCLUDE, INPUT={mesh_file.name}",
        "*NSET, NSET=ENDS",
        *(f"{node + 1}," for node in nodes),  # CalculiX counts from 1
        "*MATERIAL, NAME=NITINOL",
        "*ELASTIC",
        f"{young_MPa:{_NUMBER}}, {poisson:{_NUMBER}}",
        "*SOLID SECTION, ELSET=METAL, MATERIAL=NITINOL",
    ]


def write_input(solid: Solid, path: Path) -> None:
    """Write the input of :func:`calculix_stiffness` at ``path``, and the mesh in a second file next to it."""
    ends = np.concatenate(end_nodes(solid))
    lines = _head(solid.points_mm, cells(solid.mesh), ends, solid.young_MPa, solid.poisson, path)
    nodes = ends + 1
    motions = _end_motions(solid)
    for step in range(6):
        lines += ["*STEP", "*STATIC", "*BOUNDARY"]
        for node, motion in zip(nodes, motions[:, :, step], strict=True):
            lines += [f"{node}, {axis}, {axis}, {value:{_NUMBER}}" for axis, value in enumerate(motion, start=1)]
        lines += ["*NODE PRINT, NSET=ENDS", "RF", "*END STEP"]
    path.write_text("\n".join(lines) + "\n")


def read_reactions(path: Path, *, steps: int) -> Floats:
    """Reaction forces of a ``.dat`` file: shape (steps, nodes, 3), N, nodes as they were printed.

    Raises
    ------
    CalculixError
        If a step is missing.
    """
    blocks = re.split(r"forces \(fx,fy,fz\).*\n", path.read_text())[1:]
    if len(blocks) != steps:
        raise CalculixError(f"{path.name}: {len(blocks)} blocks of forces: expected {steps}")
    return np.array(
        [[line.split()[1:4] for line in block.splitlines() if line.strip()] for block in blocks], dtype=float
    )


def _end_motions(solid: Solid) -> Floats:
    """Displacements (k, 3, 6) of the end nodes, proximal first, for a unit of each relative motion."""
    ends = end_nodes(solid)
    motions = [
        sign / 2 * rigid_motions(solid.points_mm[nodes]).reshape(3, -1, 6)
        for sign, nodes in zip((-1, 1), ends, strict=True)
    ]
    return np.concatenate(motions, axis=1).transpose(1, 0, 2)
