"""CalculiX as a referee: the stiffness of one SNR from an independent code on the same mesh.

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
from numpy.typing import NDArray

from fem_models.solid import Solid, cells, end_nodes, rigid_motions

Floats = NDArray[np.float64]

TIME_LIMIT_S = 600.0

_NUMBER = ".12e"  # CalculiX reads the first 20 characters of a number


class CalculixError(RuntimeError):
    """CalculiX is not there or gave no result; one line with the reason."""


def calculix_stiffness(solid: Solid, *, program: str = "ccx") -> Floats:
    """Stiffness (6, 6) between rigid end plates, N, mm, rad, as :func:`fem_models.solid.snr_stiffness` defines it.

    Six linear steps prescribe the displacements of all nodes of both end faces; the stiffness is the work of their
    reaction forces. Elements are C3D10, which CalculiX integrates with four points.

    Raises
    ------
    CalculixError
        If the program is missing, fails, or leaves no reaction forces.
    """
    found = shutil.which(program)
    if found is None:
        raise CalculixError(f"{program}: expected the program of CalculiX on the path")
    with tempfile.TemporaryDirectory() as folder:
        job = Path(folder) / "snr.inp"
        write_input(solid, job)
        environment = {"OMP_NUM_THREADS": str(os.cpu_count() or 1), **os.environ}
        command = [found, "-i", job.stem]
        try:
            done = subprocess.run(
                command, cwd=folder, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False, env=environment
            )
        except subprocess.TimeoutExpired:
            raise CalculixError(f"{program} did not end within {TIME_LIMIT_S:g} s") from None
        results = job.with_suffix(".dat")
        if done.returncode or not results.exists():
            said = [line for line in done.stdout.splitlines() if "ERROR" in line] or ["no results"]
            raise CalculixError(f"{program} failed with exit code {done.returncode}: {said[0].strip()[:200]}")
        forces = read_reactions(results, steps=6)
    return np.asarray(np.einsum("nai,sna->is", _end_motions(solid), forces))


def write_input(solid: Solid, path: Path) -> None:
    """Write the input of :func:`calculix_stiffness` at ``path``, the mesh in a file of its own beside it."""
    mesh_file = path.with_name(f"{path.stem}-mesh.inp")
    tetrahedra = cells(solid.mesh)
    mesh = meshio.Mesh(
        solid.points_mm, [("tetra10", tetrahedra)], cell_sets={"METAL": [np.arange(len(tetrahedra), dtype=np.int64)]}
    )
    mesh.write(mesh_file, file_format="abaqus", float_fmt=_NUMBER)
    # meshio knows several ten-node elements of this format and names the last of them, a hybrid that CalculiX lacks
    mesh_file.write_text(re.sub(r"TYPE=C3D10\w*", "TYPE=C3D10", mesh_file.read_text()))
    nodes = np.concatenate(end_nodes(solid)) + 1  # CalculiX counts from 1
    lines = [
        f"*INCLUDE, INPUT={mesh_file.name}",
        "*NSET, NSET=ENDS",
        *(f"{node}," for node in nodes),
        "*MATERIAL, NAME=NITINOL",
        "*ELASTIC",
        f"{solid.young_MPa:{_NUMBER}}, {solid.poisson:{_NUMBER}}",
        "*SOLID SECTION, ELSET=METAL, MATERIAL=NITINOL",
    ]
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
