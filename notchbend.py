"""Notched, tendon-driven manipulators: simulate, identify, trace, separate, compensate, and study many cases.

>>> import notchbend as nb
>>> record = nb.simulate("du2018", nb.triangle(2.2, cycles=3), engine="chain")
>>> fit = nb.identify(record)
>>> figure = nb.plot(fit)

A record may be given as the path of its CSV or as a DataFrame, a rig as the path of its file or the name of a preset.
Units are part of the names (mm, N, s, deg). Results show one line at a prompt, a screen by ``print`` and a table in a
notebook, and convert: ``to_dict``, ``to_dataframe``, ``to_xarray``.
"""

from importlib.metadata import version

from notchbend_start import require_own_packages

require_own_packages()

from fem_models.load import LoadProgram, sine, triangle
from fem_models.rig import Rig, RigError, ensemble, preset, read_rig
from fem_models.rig.checks import SolverError
from hysteresis import Fit, Record, read_record
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.record import RecordError
from studies.engines import MissingError
from studies.notebook.calls import (
    calibrate,
    compensate,
    export,
    follow,
    identify,
    identify_each,
    plot,
    separate,
    simulate,
    study,
    trace,
    write_record,
)
from studies.sweep.errors import StudyError

__version__ = version("notchbend")

__all__ = [
    "Fit",
    "IdentifySettings",
    "LoadProgram",
    "MissingError",
    "Record",
    "RecordError",
    "Rig",
    "RigError",
    "SolverError",
    "StudyError",
    "__version__",
    "calibrate",
    "compensate",
    "ensemble",
    "export",
    "follow",
    "identify",
    "identify_each",
    "plot",
    "preset",
    "read_record",
    "read_rig",
    "separate",
    "simulate",
    "sine",
    "study",
    "trace",
    "triangle",
    "write_record",
]
