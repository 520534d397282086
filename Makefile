# make study   environment, main run, path of the report
# make install environment alone
# make test    lint, types, import contract, tests
# make site    the pages as a site, in build/site
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
OUT    ?= results/first-report

.PHONY: study install test site lock clean

study: install
	$(BIN)/notchbend run --out $(OUT)

install: $(VENV)/.installed

# The lock file pins what was tested; the project itself goes in editable, without touching those pins.
$(VENV)/.installed: pyproject.toml requirements.lock
	$(PYTHON) -c 'import sys; v = sys.version_info[:2]; sys.exit(0 if v >= (3, 11) else "notchbend needs Python >= 3.11, this is %d.%d" % v)'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --editable .
	touch $@

test: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest -n auto --dist worksteal

site: install
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

lock: install
	$(BIN)/python -m pip install --quiet 'pip-tools>=7.6.2'
	$(BIN)/pip-compile --quiet --extra dev --extra docs --strip-extras --allow-unsafe --no-emit-index-url --no-emit-find-links --output-file requirements.lock pyproject.toml

clean:
	rm -rf $(VENV) build *.egg-info
