# Two commands do everything: `make run` and `make test`. They need Python 3.11+ and make.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin

.PHONY: run test test-slow lint docs bench bench-quick bench-guard coverage mutation fuzz audit \
	licences sample-study clean
.DEFAULT_GOAL := run

$(VENV)/installed: pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "covertool needs Python 3.11 or newer; try: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[all,dev]'
	touch $@

# The whole flow on the synthetic sample study: a study, a report and a table of coverage.
run: $(VENV)/installed
	mkdir -p out
	$(BIN)/covertool run --example > out/plan.toml
	$(BIN)/covertool run out/plan.toml --overwrite
	$(BIN)/covertool coverage out/sample.gpkg --radius 15

lint: $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: lint
	$(BIN)/python -m pytest -n 2 -m "not slow"

# What takes longer: killed and starved runs, installed wheels, notebooks, every command of the README.
test-slow: $(VENV)/installed
	$(BIN)/python -m pytest -n 2 -m slow

docs: $(VENV)/installed
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs docs/_build/html

# Side-by-side ratios, written to benchmarks/RESULTS.md and results.json; the machine should be quiet.
bench: $(VENV)/installed
	$(BIN)/python -m benchmarks

bench-quick: $(VENV)/installed
	$(BIN)/python -m benchmarks --quick

# Exit 1 when a ratio lost more than half of what benchmarks/results.json keeps; not part of CI.
bench-guard: $(VENV)/installed
	$(BIN)/python -m benchmarks --guard

# The quick tests by line and branch, and the compiled loops once more as plain Python.
coverage: $(VENV)/installed
	COVERAGE_FILE=.coverage-compiled $(BIN)/python -m pytest -n 2 -m 'not slow' --cov=covertool --cov-report= --ignore=tests/package --ignore=tests/kill
	NUMBA_DISABLE_JIT=1 COVERAGE_FILE=.coverage-plain $(BIN)/python -m pytest -n 2 --cov=covertool --cov-report= $(KERNEL_TESTS)
	$(BIN)/coverage combine .coverage-compiled .coverage-plain
	$(BIN)/coverage report --skip-covered --show-missing --sort=cover

KERNEL_TESTS = tests/analytic tests/coverage/test_areas.py tests/positioning/test_ekf.py \
	tests/positioning/test_estimators.py tests/positioning/test_neighbours.py \
	-m 'not slow' -k 'not 0.001 and not poisson and not five_thousand'

# Small faults put into three engines, at most 200 each; survivors are printed (tests/mutation/README.md).
mutation: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --constraint constraints.txt cosmic-ray
	$(BIN)/python -m tests.mutation

# Look for bytes that break a reader: FUZZ_S seconds a target, all of them in ten minutes; with
# `make -j2 fuzz` two at a time. What is found lies in out/fuzz. The long run is FUZZ_S=600.
FUZZ_S ?= 30
FUZZ_TARGETS ?= $(notdir $(wildcard fuzz/corpus/*))
fuzz: $(FUZZ_TARGETS:%=fuzz-%)

fuzz-%: $(VENV)/atheris
	$(BIN)/python -m fuzz $* $(FUZZ_S)

$(VENV)/atheris: $(VENV)/installed
	$(BIN)/python -m pip install --quiet atheris==3.0.0
	touch $@

# Known faults of the pinned dependencies; asks a service on the network.
audit: $(VENV)/installed
	$(BIN)/python -m pip install --quiet pip-audit
	$(BIN)/pip-audit --requirement constraints.txt --no-deps --disable-pip --strict

# Every dependency with its version and licence, as a table.
licences: $(VENV)/installed
	@$(BIN)/python -m tools.licences

# Make the synthetic sample study anew; same seed, same bytes.
sample-study: $(VENV)/installed
	PYTHONPATH=training $(BIN)/python -m data.recipe

clean:
	rm -rf .coverage* $(VENV) out build dist docs/_build docs/generated .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis
