# Every target does its own set-up in a virtual environment; nothing is installed outside it.
PYTHON ?= python3
VENV ?= .venv
OUT ?= friction_bayes_demo
PYTEST_ARGS ?= -n 2

BIN = $(VENV)/bin
# half the time of an installation is the bytecode of modules that nothing loads: Python makes what it does load
INSTALL = $(BIN)/python -m pip install --no-compile --quiet --disable-pip-version-check
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo test docs paper blind measured bench lint build clean

help:
	@echo "make demo      the main job on synthetic records: every estimator, and a closed loop, in under a minute"
	@echo "make test      the whole test suite"
	@echo "make docs      the site of the documentation, in build/site; runs its notebooks"
	@echo "make paper     every result and figure of the paper, next to its numbers, and what each took; resumes what was interrupted"
	@echo "make blind     the loop on sealed synthetic records"
	@echo "make measured  the estimators and the loop on measured records, which are downloaded"
	@echo "make bench     time, memory and accuracy by asv, kept for each commit"
	@echo "make lint      style, format and types"
	@echo "make build     wheel and sdist, tried out from an empty folder"
	@echo "make clean     remove what the targets made"

$(VENV)/.base: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable .
	@touch $@

# the kernels that the demonstration needs, compiled once and kept on disk
$(VENV)/.compiled: $(VENV)/.base
	$(BIN)/friction-bayes simulate --mass 10 --stiffness 1000 --friction 0.07 --sampling-rate 200 --seed 1 \
		--out $(VENV)/first.csv --force
	$(BIN)/friction-bayes estimate $(VENV)/first.csv --mass 10 --stiffness 1000 --json > /dev/null
	$(BIN)/friction-bayes estimate $(VENV)/first.csv --mass 10 --stiffness 1000 --method envelope --json > /dev/null
	$(BIN)/friction-bayes simulate --mass 10 --stiffness 1000 --friction 0.07 --initial-displacement 0.0035 \
		--sampling-rate 200 --seed 2 --out $(VENV)/second.csv --force
	$(BIN)/friction-bayes close-loop $(VENV)/first.csv --mass 10 --stiffness 1000 --out $(VENV)/loop --force --json > /dev/null
	$(BIN)/friction-bayes close-loop $(VENV)/first.csv $(VENV)/second.csv --mass 10 --stiffness 1000 --out $(VENV)/loop --force \
		--json > /dev/null
	@touch $@

$(VENV)/.test: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable ".[test]"
	@touch $@

# brings what the tests need too
$(VENV)/.dev: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable ".[dev]"
	@touch $@ $(VENV)/.test

$(VENV)/.docs: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable ".[docs]"
	@touch $@

demo: $(VENV)/.compiled
	$(BIN)/friction-bayes demo --out $(OUT) --force

test: $(VENV)/.test
	$(BIN)/python -m pytest $(PYTEST_ARGS)

docs: $(VENV)/.docs
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --nitpicky --fresh-env --quiet docs build/site

paper: $(VENV)/.test
	$(BIN)/python -m experiments paper
	$(BIN)/python -m paper_figures

blind: $(VENV)/.test
	$(BIN)/python -m experiments blind

measured: $(VENV)/.test
	$(BIN)/python -m experiments measured

# in the environment that is there: of another commit, asv makes its own
bench: $(VENV)/.dev
	$(BIN)/asv machine --config benchmarks/asv.conf.json --yes
	ASV_PYTHONPATH=$(CURDIR) OMP_NUM_THREADS=1 $(BIN)/asv run --config benchmarks/asv.conf.json --environment existing:$(abspath $(BIN)/python) \
		--set-commit-hash $$(git rev-parse HEAD)

lint: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

build: $(VENV)/.dev
	$(BIN)/python -m build --outdir dist .
	VENV_PYTHON=$(abspath $(BIN)/python) sh .ci/try-wheel dist/*.whl

clean:
	rm -rf $(VENV) build dist .cache .mypy_cache .ruff_cache .pytest_cache .hypothesis friction_bayes_demo
