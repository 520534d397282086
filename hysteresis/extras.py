"""Libraries that one function asks for: the extras of an installation, and what is said where one is missing."""

from __future__ import annotations

from importlib.util import find_spec

EXTRAS = {
    "view": ("pyvista", "vtk"),
    "solid": ("gmsh", "skfem", "cholespy"),
    "study": ("dask", "distributed", "cryptography", "pandas", "xarray", "zarr", "SALib", "pymoo"),
    "app": ("trame", "trame_vtk"),
    "data": ("pooch", "requests", "platformdirs"),
    "tables": ("openpyxl", "pyarrow"),
    "cma": ("cma",),
    "drawing": ("ezdxf",),
}
"""Top packages that each extra of pyproject.toml imports."""


class MissingError(RuntimeError):
    """A library that is not installed on this machine; one line that names it."""


def require_extra(extra: str, purpose: str) -> None:
    """Refuse where a library of an extra is not installed.

    Raises
    ------
    MissingError
        One line: the library, what it is for and what to install.
    """
    for name in EXTRAS[extra]:
        if not _is_installed(name):
            raise MissingError(f"{name} is not installed: expected for {purpose}: pip install 'notchbend[{extra}]'")


def _is_installed(name: str) -> bool:
    try:
        return find_spec(name) is not None
    except ValueError:  # a module that was loaded without a specification, or is barred
        return False
