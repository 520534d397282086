"""``python -m docs.make.benchmark WAY.json ...``: see :mod:`docs.make.benchmark.tables`."""

from docs.make.benchmark.tables import main

main()
