"""A plugin of pytest: shortest tests first, and the time that each one takes.

Run it with ``pytest -p tests.mutation.in_order``. ``MUTATION_TIMES`` names a file of JSON lines: the times of the tests
are read from it, and with ``MUTATION_WRITE`` set those of this run are added to it.
"""

import json
import os
from pathlib import Path

import pytest


def times(path: Path) -> dict[str, float]:
    """Seconds of each test by its name, set-up included."""
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()] if path.exists() else []
    total: dict[str, float] = {}
    for row in rows:
        total[row["test"]] = total.get(row["test"], 0.0) + row["seconds"]
    return total


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put short tests first; those without a known time come last."""
    if "MUTATION_TIMES" in os.environ and "MUTATION_WRITE" not in os.environ:
        known = times(Path(os.environ["MUTATION_TIMES"]))
        items.sort(key=lambda item: known.get(item.nodeid, 1e9))


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Write the time of one phase of a test, once: workers of xdist leave it to the process that started them."""
    if "MUTATION_WRITE" in os.environ and "PYTEST_XDIST_WORKER" not in os.environ:
        with Path(os.environ["MUTATION_TIMES"]).open("a", encoding="utf-8") as file:
            file.write(json.dumps({"test": report.nodeid, "seconds": report.duration}) + "\n")
