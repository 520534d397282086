"""Tables of numbers as loggers, spreadsheets and other programs write them, read as columns by name."""

from studies.own_rig.tables.read import read_table
from studies.own_rig.tables.table import BenchTable, Column

__all__ = ["BenchTable", "Column", "read_table"]
