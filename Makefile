# Everything is done from here; `make` alone lists the targets. Needs make and Python 3.11 or newer, nothing else.
PYTHON ?= python3
JOBS ?= 3
VENV := .venv
BARE := .venv-bare
BIN := $(VENV)/bin
PIP := -m pip --disable-pip-version-check -q
PINS := requirements/constraints.txt
NEEDS := pyproject.toml $(PINS)
PACKAGE := $(shell find src pyproject.toml README.md -type f -not -name '*.py[co]' -not -name '*.nb[ci]' 2>/dev/null)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help setup run test check format docs golden kernels bench lock clean distclean

help:  ## List the targets
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

setup: $(VENV)/.ready  ## Make .venv with the package, its extras and the tools of the checks

# Storm is not built for every machine: where its wheel is missing, all the rest is still set up.
$(VENV)/.ready: $(NEEDS)
	@tools/check_python $(PYTHON)
	@echo "Setting up $(VENV): about a minute."
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	@$(BIN)/python $(PIP) install -c $(PINS) -e '.[dev,parquet,storm]' 2>$(VENV)/storm.log || \
	    { echo "stormpy cannot be installed here ($(VENV)/storm.log says why): going on without the extra [storm]."; \
	      $(BIN)/python $(PIP) install -c $(PINS) -e '.[dev,parquet]'; }
	@$(BIN)/python -m compileall -q src
	@touch $@

# The second environment has no extras, and the package as a user gets it: built, not editable.
$(BARE)/.ready: $(NEEDS)
	@tools/check_python $(PYTHON)
	@echo "Setting up $(BARE), without extras: about half a minute."
	@test -x $(BARE)/bin/python || $(PYTHON) -m venv $(BARE)
	@$(BARE)/bin/python $(PIP) install -c $(PINS) '.[test]'
	@touch $@ $(BARE)/.package
$(BARE)/.package: $(BARE)/.ready $(PACKAGE)
	@$(BARE)/bin/python $(PIP) install --no-deps --force-reinstall .
	@touch $@

run: $(VENV)/.ready  ## Set up, then explain the paper's map: printed, written to out/route.json, and verified
	@mkdir -p out
	$(BIN)/ratherthan explain example:paper-5x5
	$(BIN)/ratherthan explain example:paper-5x5 --format json > out/route.json
	$(BIN)/ratherthan verify out/route.json example:paper-5x5

test: check $(BARE)/.package  ## Set up, then run all checks and all tests
	$(BIN)/pytest -n $(JOBS)
	RATHERTHAN_COMPILE=always $(BIN)/pytest -n $(JOBS) -m kernels
	RATHERTHAN_MODELS=20 RATHERTHAN_COMPILE=never NUMBA_DISABLE_JIT=1 $(BARE)/bin/pytest -n $(JOBS) -m 'not slow' --hypothesis-profile=quick

check: $(VENV)/.ready  ## Format, lint, types, walls, and docs in step with the code
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python tools/docs_in_step.py

format: $(VENV)/.ready  ## Format the code and mend what the linter can mend
	$(BIN)/ruff check --fix --exit-zero
	$(BIN)/ruff format

docs: $(VENV)/.ready  ## Write the generated pages anew: docs/cli.md and docs/schema/
	$(BIN)/python tools/docs_in_step.py --write

kernels: $(VENV)/.ready  ## Turn the kernels into the text that travels with the package, anew
	RATHERTHAN_COMPILE=auto $(BIN)/python tools/ship_kernels.py

golden: $(VENV)/.ready  ## Write the golden files anew; review the difference before you keep it
	$(BIN)/pytest -n $(JOBS) -m golden --update-golden

bench: $(VENV)/.ready  ## Print ratios against peers measured in the same run; NAMES="maps traps" for some
	@$(BIN)/python $(PIP) install -e '.[bench]' || echo "The peers cannot be installed here: they are left out."
	$(BIN)/python -m benchmarks $(NAMES)

lock: $(VENV)/.ready  ## Move all pins to the newest versions that pyproject.toml allows
	$(PYTHON) tools/lock.py

clean:  ## Remove what the checks and runs left behind; the environments stay
	rm -rf out build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find src tests benchmarks tools -name __pycache__ -type d -prune -exec rm -rf {} +

distclean: clean  ## Remove the environments too
	rm -rf $(VENV) $(BARE)
