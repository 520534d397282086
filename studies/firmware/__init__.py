"""The compensator of an identified law for firmware: C99, a test vector, and tables of its branches."""

from studies.firmware.files import compensator_files, table_files
from studies.firmware.read import Compensator, read_compensator

__all__ = ["Compensator", "compensator_files", "read_compensator", "table_files"]
