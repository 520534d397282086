"""The compensator of an identified law: C99 with a test vector, units of co-simulation, tables of its branches."""

from studies.firmware.files import compensator_files, table_files
from studies.firmware.read import Compensator, read_compensator
from studies.firmware.unit import unit_files

__all__ = ["Compensator", "compensator_files", "read_compensator", "table_files", "unit_files"]
