"""The code and the libraries that the numbers of a case depend on: part of the key of every stored case.

A case that other code computed is not taken from the store, and a worker that runs other code is refused. The files are
listed here; ``tests/studies/sweep/test_code.py`` holds the list against the imports of :mod:`studies.sweep.cases`.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from socket import gethostname
from typing import TypeVar

from studies.sweep.errors import LostError

Given = TypeVar("Given")
Answer = TypeVar("Answer")
SAME = "expected the same versions of notchbend and its libraries as here"

ROOT = Path(__file__).parents[2]
FOLDERS = ("hysteresis", "fem_models")
DRAWING = "fem_models/view"
"""The folder in these that only draws."""
FILES = (
    "validation/__init__.py",
    "validation/separation/__init__.py",
    "validation/separation/contributions.py",
    "validation/separation/posterior.py",
    "validation/separation/priors.py",
    "validation/separation/rig_calibration.py",
    "studies/__init__.py",
    "studies/engines.py",
    "studies/own_rig/__init__.py",
    "studies/own_rig/plane.py",
    "studies/sweep/wrist.py",
    "studies/sweep/__init__.py",
    "studies/sweep/cases.py",
    "studies/sweep/code.py",
    "studies/sweep/errors.py",
    "studies/sweep/inputs.py",
    "studies/sweep/quantities.py",
)
LIBRARIES = {
    "chain": ("numpy", "scipy", "numba"),
    "analytic": ("numpy", "scipy"),
    "multibody": ("numpy", "scipy", "exudyn"),
    "solid": ("numpy", "scipy", "numba", "gmsh", "scikit-fem", "cholespy"),
    "chain-in-space": ("numpy", "scipy", "numba"),
}
"""Libraries that an engine computes with."""


def sources(root: Path = ROOT) -> list[Path]:
    """Give the files that a number of a case may depend on, relative to ``root``, in order."""
    found = {path.relative_to(root) for folder in FOLDERS for path in (root / folder).rglob("*.py")}
    return sorted({path for path in found if not path.is_relative_to(DRAWING)} | {Path(name) for name in FILES})


def digest(root: Path = ROOT) -> str:
    """Compute the sha256 of :func:`sources`: of the path of each file from ``root``, and of its content."""
    whole = hashlib.sha256()
    for path in sources(root):
        whole.update(path.as_posix().encode() + b"\0" + hashlib.sha256((root / path).read_bytes()).digest())
    return whole.hexdigest()


@cache
def code_version(engine: str) -> str:
    """Compute the sha256 of the code that an engine's numbers depend on, and of the versions of its libraries."""
    return hashlib.sha256((digest() + json.dumps(versions(engine))).encode()).hexdigest()


def code_of_worker(engine: str) -> str:
    """Give the code version of the process that runs this, a worker's."""
    return code_version(engine)


def with_code(code: str, engine: str, work: Callable[[Given], Answer], given: Given) -> Answer:
    """Do some work of a study in a worker that has this code: one may have joined a cluster after the others.

    Raises
    ------
    LostError
        Other code here.
    """
    if code_version(engine) != code:
        raise LostError(f"workers: one on {gethostname()} runs other code: {SAME}")
    return work(given)


def versions(engine: str) -> dict[str, str]:
    """Give the versions of the libraries that an engine computes with, and of this package if it is installed."""
    try:
        own = {"notchbend": version("notchbend")}
    except PackageNotFoundError:  # run from its sources
        own = {}
    return own | {name: version(name) for name in LIBRARIES[engine]}
