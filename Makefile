# Two commands do everything: `make run` and `make test`. They need Python 3.11+ and make.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin

.PHONY: run test lint docs bench bench-quick fuzz audit licences sample-study clean
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
	$(BIN)/python -m pytest -n 2

docs: $(VENV)/installed
	$(BIN)/python -m sphinx -q -W --keep-going -b html docs docs/_build/html

# Side-by-side ratios, printed as Markdown tables; the machine should be quiet.
bench: $(VENV)/installed
	for room in coverage raster scale positioning extraction; do $(BIN)/python -m benchmarks.$$room || exit 1; done

bench-quick: $(VENV)/installed
	for room in coverage raster scale positioning; do $(BIN)/python -m benchmarks.$$room --quick || exit 1; done

# Look for bytes that break a reader: FUZZ_S seconds a target, all of them in ten minutes. What is
# found lies in out/fuzz. The long run is FUZZ_S=600.
FUZZ_S ?= 30
FUZZ_TARGETS ?= $(notdir $(wildcard fuzz/corpus/*))
fuzz: $(VENV)/installed
	$(BIN)/python -m pip install --quiet atheris==3.0.0
	for target in $(FUZZ_TARGETS); do $(BIN)/python -m fuzz $$target $(FUZZ_S) || exit 1; done

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
	rm -rf $(VENV) out build dist docs/_build docs/generated .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis
