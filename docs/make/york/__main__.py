"""``python -m docs.make.york``: see :mod:`docs.make.york.page`."""

from docs.make.york.page import main

main()
