"""What commands store and the report reads: a dataclass for each JSON file, and how they are written and read."""

from studies.results.files import read_result, write_result

__all__ = ["read_result", "write_result"]
