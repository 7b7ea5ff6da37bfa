# make demo   sets everything up and finds a target too weak to see
# make test   sets everything up and runs the whole suite
# The other targets: validate, thorough, bench, lint, docs, figures, clean.

PYTHON ?= python3
VENV ?= .venv
JOBS ?= 4

BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
INSTALL := $(PIP) install --only-binary=:all: --constraint constraints.txt
PINS := pyproject.toml constraints.txt

export PIP_NO_INPUT = 1
# What is compiled once is kept, whatever the shell says: tests start many processes of the same modules.
export PYTHONDONTWRITEBYTECODE =

.DEFAULT_GOAL := help
.PHONY: help demo test validate thorough bench lint docs figures clean
.DELETE_ON_ERROR:

help:
	@sed -n 's/^# //p' Makefile

demo: $(VENV)/.core
	$(BIN)/elusive demo --out demo

# processes for two cores, of which some often wait for a browser, a server, or a kernel that another one compiles;
# threads of linear algebra would only wait for each other
test validate thorough: export OPENBLAS_NUM_THREADS = 1

test: $(VENV)/.dev
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal

validate: $(VENV)/.docs
	$(BIN)/python -m pytest -m validate -n $(JOBS) --dist worksteal

# many drawn worlds of each system, and long runs: hours
thorough: $(VENV)/.dev
	$(BIN)/python -m pytest -m thorough -n $(JOBS) --dist worksteal

bench: $(VENV)/.dev
	$(BIN)/python -m pytest benchmarks

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	@if ! command -v npm >/dev/null; then echo "JavaScript is not checked: npm is not installed (Node.js 20 or later)."; \
	elif ! npm install --prefix tools/js --no-audit --no-fund --silent; then \
	    echo "JavaScript is not checked: its linters could not be installed, see above."; \
	else npm run --prefix tools/js --silent lint; fi

docs: $(VENV)/.docs
	$(BIN)/sphinx-build -W -q --keep-going -b html docs docs/_build/html
	@echo "Open docs/_build/html/index.html"

# the picture of the README and the table of docs/amrouche2018.md (about an hour on two cores)
figures: $(VENV)/.dev
	$(BIN)/python docs/make_figures.py

clean:
	rm -rf $(VENV) demo docs/_build tools/js/node_modules

# Installed once, and again only when a pin or the project's own list of dependencies changes.
$(VENV)/.core: $(VENV)/.python $(PINS)
	@echo "Installing what elusive needs (the first time only) ..."
	@$(INSTALL) hatchling editables
	@$(INSTALL) --no-build-isolation --editable .
	@touch $@

# Python compiles a module when it is first imported: most of those installed here never are.
$(VENV)/.dev: $(VENV)/.python $(PINS)
	@echo "Installing what elusive and its tests need (the first time only) ..."
	@$(INSTALL) --no-compile hatchling editables
	@$(INSTALL) --no-compile --no-build-isolation --editable ".[video,cluster,ais,charts,workbench,live,test,bench,lint]"
	@touch $(VENV)/.core $@

$(VENV)/.docs: $(VENV)/.dev
	@echo "Installing what the documentation needs (the first time only) ..."
	@$(INSTALL) --no-compile --no-build-isolation --editable ".[docs]"
	@touch $@

$(VENV)/.python:
	@$(PYTHON) -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 14))' 2>/dev/null || { \
	    echo "elusive needs Python 3.11 to 3.14, and '$(PYTHON)' is" \
	         "$$($(PYTHON) --version 2>&1 | head -n 1). Name another: make $(or $(MAKECMDGOALS),demo) PYTHON=python3.12" >&2; \
	    exit 1; }
	@$(PYTHON) -m venv $(VENV) || { rm -rf $(VENV); \
	    echo "No virtual environment could be made: see above (on Debian and Ubuntu: apt install python3-venv)." >&2; exit 1; }
	@touch $@
