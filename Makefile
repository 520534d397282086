# make study   environment, main run, path of the report
# make install what every command needs, and no more
# make dev     all extras and the tools of developers, too
# make test    lint, types, import contract, tests
# make slow    the tests that take long: before the tracer, an engine, a page or the packaging is changed for good
# make site    the pages as a site, in build/site
PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
OUT    ?= results/first-report

.PHONY: study install dev test checks tests slow kernels site lock clean

PIP     := $(BIN)/python -m pip
INSTALL := $(PIP) install --quiet --disable-pip-version-check
COMPILE := $(BIN)/pip-compile --quiet --strip-extras --allow-unsafe --no-emit-index-url --no-emit-find-links

# extras name the project itself, which no lock file may
OWN_OUT := sed -i '/^notchbend @/,/^[^ ]/{/^notchbend @\|^ /d}'

study: install
	$(BIN)/notchbend run --out $(OUT)

install: $(VENV)/.installed
dev: $(VENV)/.dev-installed

# A lock file pins what was tested; the project itself goes in editable, without touching those pins.
$(VENV)/.installed: pyproject.toml requirements.lock
	$(PYTHON) -c 'import sys; v = sys.version_info[:2]; sys.exit(0 if v >= (3, 11) else "notchbend needs Python >= 3.11, this is %d.%d" % v)'
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) -r requirements.lock
	$(INSTALL) --no-deps --editable .
	$(BIN)/python -m studies.kernels
	touch $@

# Both environments are one: what developers need goes on top, and requirements-dev.lock has the same versions.
$(VENV)/.dev-installed: $(VENV)/.installed requirements-dev.lock
	$(INSTALL) -r requirements-dev.lock
	touch $@

# The kernels are compiled first, because every worker of pytest would do it; meanwhile the checks keep a core busy.
test: dev
	$(MAKE) --no-print-directory --jobs=2 checks tests

# With compiled tests kept: where PYTHONDONTWRITEBYTECODE is set, every worker would rewrite and compile all of them.
tests: kernels
	PYTHONDONTWRITEBYTECODE= $(BIN)/pytest -n auto --dist worksteal

# What takes long, as whole traces, many draws, the site, the wheel, the gallery, and practice cases that were missed once.
slow: dev kernels
	PYTHONDONTWRITEBYTECODE= $(BIN)/pytest -n auto --dist worksteal -m slow -o faulthandler_timeout=1800

checks:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

kernels:
	$(BIN)/python -m studies.kernels alike heated in_space differing laws

site: dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

lock: install
	$(INSTALL) 'pip-tools>=7.6.2'
	$(COMPILE) --extra view --extra solid --extra study --extra app --extra data --extra tables --extra drawing --extra cma --output-file requirements.lock pyproject.toml
	$(OWN_OUT) requirements.lock
	$(COMPILE) --extra dev --constraint requirements.lock --output-file requirements-dev.lock pyproject.toml
	$(OWN_OUT) requirements-dev.lock

clean:
	rm -rf $(VENV) build *.egg-info
