# Every command sets up what it needs: a virtual environment in .venv with the versions of constraints.txt.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
BIN := $(VENV)/bin
SETUP := $(VENV)/.complete
OUT ?= out
LONG := agreement calibration discovery concepts new_words practice
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: help setup demo test test-slow test-discovery lint types bench calibrate clean

help:
	@echo "make demo       the main job on the example that ships: a video in, a report out"
	@echo "make test       the fast tests"
	@echo "make test-slow  the statistical and large tests"
	@echo "make test-discovery  hide effects in data and require finding them, tables to docs/ (hours; goes on where it was)"
	@echo "make lint       format and lint"
	@echo "make types      types"
	@echo "make calibrate  simulation-based calibration of every sampler, figures to docs/ (a day; goes on where it was)"
	@echo "make bench      every benchmark but the long ones ($(LONG)), tables to the terminal and JSON to $(OUT)/"
	@echo "make clean      remove the environment and caches; $(OUT)/ stays"

setup: $(SETUP)

$(SETUP): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt torch==2.13.0
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable ".[dev]"
	$(BIN)/vrdp-prob compile
	touch $(SETUP)

demo: $(SETUP)
	$(BIN)/vrdp-prob demo --out $(OUT)/demo

test: $(SETUP)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -m "not slow" -n 2 --dist loadfile

test-slow: $(SETUP)
	OMP_NUM_THREADS=1 $(BIN)/python -m pytest -m slow -n 2 --dist loadfile

test-discovery: $(SETUP)
	mkdir -p $(OUT)
	$(BIN)/python benchmarks/discovery.py --docs docs --json $(OUT)/discovery.json

lint: $(SETUP)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(SETUP)
	$(BIN)/mypy

bench: $(SETUP)
	mkdir -p $(OUT)
	for script in $(filter-out $(LONG:%=benchmarks/%.py),$(wildcard benchmarks/[a-z]*.py)); do \
	  $(BIN)/python $$script --json $(OUT)/$$(basename $$script .py).json || exit 1; \
	done

calibrate: $(SETUP)
	mkdir -p $(OUT)
	$(BIN)/python benchmarks/calibration.py --samplers laplace-alone,laplace,emcee,nuts --docs docs --json $(OUT)/calibration.json

clean:
	rm -rf $(VENV) .pytest_cache .mypy_cache .ruff_cache build dist
