# `make quickstart` and `make test` are all that a newcomer needs; both make .venv on a machine with only Python.

PYTHON ?= python3
BIN := .venv/bin
QUICK := data/quick
SECONDS ?= 300
HOURS ?= 3
SEED ?= 1
.DEFAULT_GOAL := help
# Installations leave compiling to the first import, so that each module must be compiled once, not in each process.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help quickstart test test-browser test-torch lowest fuzz paper paper-search bench check types lint docs peers wheel clean

help:
	@echo "make quickstart   install, make the quick database, its models and reports, query, draw"
	@echo "make test         run the test suite"
	@echo "make test-browser test the explorer in Chromium, which must be installed"
	@echo "make test-torch   train with torch from a database, in an environment of its own"
	@echo "make lowest       run the test suite with the lowest versions of all dependencies that pyproject.toml allows"
	@echo "make fuzz         damage and disguise all that sigdb reads, for SECONDS=300 with SEED=1; one KIND, and of it one CASE"
	@echo "make paper        evaluate and draw the rigs that show the paper's pictures, in 10 minutes"
	@echo "make paper-search search for such rigs again, by SEED=1, in HOURS=3 at most; a search that was stopped goes on"
	@echo "make check        lint, format, types, contracts of packages, names and prose"
	@echo "make docs         build the documentation into docs/_build"
	@echo "make bench        measure speed against peers, in 20 minutes, for the README and the documentation"
	@echo "make peers        install what the benchmarks compare with"
	@echo "make wheel        build the wheel and try it in a clean environment"

.venv/pip:
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip
	@touch $@

# An environment for each extra: made once, and again when pyproject.toml changes.
.venv/base: .venv/pip pyproject.toml
	$(BIN)/python -m pip install --quiet --no-compile --editable .
	@touch $@

.venv/%: .venv/pip pyproject.toml
	$(BIN)/python -m pip install --quiet --no-compile --editable '.[$*]'
	@touch $@

# The environments of all checks in one go, which takes half the time.
.venv/all: .venv/pip pyproject.toml
	$(BIN)/python -m pip install --quiet --no-compile --editable '.[test,check,docs,browser]'
	@touch .venv/base .venv/test .venv/check .venv/docs .venv/browser $@

quickstart: .venv/base
	$(BIN)/python -m sigdb.sweep pipelines/quick.toml
	$(BIN)/sigdb run pipelines/quick.toml
	$(BIN)/sigdb query $(QUICK)/signatures "select tooth, count(*) as rows, avg(fm4) as fm4 from features group by tooth order by tooth"
	$(BIN)/sigdb query $(QUICK)/signatures "select damaged_teeth, stiffness_loss, phase_shift_deg, min(min_compression) as min_compression from features where tooth > 0 group by all order by all"
	$(BIN)/sigdb show $(QUICK)/signatures 0 2925 --out $(QUICK)/pictures
	@echo
	@echo "For the command sigdb alone: source $(BIN)/activate"
	@echo "Made:"
	@echo "  $(QUICK)/signatures          the database; ask it: $(BIN)/sigdb query $(QUICK)/signatures \"select ...\""
	@echo "  $(QUICK)/models/location     a model of location, and one of severity beside it; README.md is the card"
	@echo "  $(QUICK)/reports/location    what that model is worth; index.html is the page"
	@echo "  $(QUICK)/pictures            a healthy signature, and one of tooth 6 with 40 % less stiffness, on one scale"

test: .venv/test
	$(BIN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

test-browser: .venv/browser
	$(BIN)/python -m pytest tests/browser

# An environment of its own, since torch is no dependency.
.venv-torch/torch: pyproject.toml
	$(PYTHON) -m venv .venv-torch
	.venv-torch/bin/python -m pip install --quiet --editable . torch "pytest>=8.2"
	@touch $@

test-torch: .venv-torch/torch
	.venv-torch/bin/python -m pytest tests/torch

# An environment of its own, with every dependency at its lower bound.
.venv-lowest/test: pyproject.toml tests/checks/lowest.py
	$(PYTHON) -m venv .venv-lowest
	.venv-lowest/bin/python tests/checks/lowest.py > .venv-lowest/lowest.txt
	.venv-lowest/bin/python -m pip install --quiet --constraint .venv-lowest/lowest.txt --editable '.[test]'
	@touch $@

lowest: .venv-lowest/test
	.venv-lowest/bin/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder

fuzz: .venv/test
	$(BIN)/python tests/fuzz/fuzz.py --seconds $(SECONDS) --seed $(SEED) $(if $(KIND),--kind $(KIND)) $(if $(CASE),--case $(CASE))

bench: .venv/all
	$(BIN)/python benchmarks/bench.py

paper: .venv/base
	$(BIN)/python benchmarks/paper_identified.py

paper-search: .venv/identify
	$(BIN)/python benchmarks/paper_search.py --out build/paper-search-$(SEED) --seed $(SEED) --hours $(HOURS)

check: types lint

types: .venv/check
	$(BIN)/mypy

lint: .venv/check
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/python tests/checks/tree.py
	$(BIN)/python tests/checks/prose.py
	$(BIN)/python tests/checks/numpydoc_names.py
	$(BIN)/codespell sigdb docs tests benchmarks pipelines README.md CHANGELOG.md Makefile pyproject.toml

docs: .venv/docs
	$(BIN)/sphinx-build -W --keep-going -b html docs docs/_build/html
	$(BIN)/python tests/checks/offline.py docs/_build/html
	@echo "docs/_build/html/index.html"

# tftb's metadata asks for a numpy older than 2, which it runs without.
peers: .venv/peers
	$(BIN)/python -m pip install --quiet --no-deps tftb

wheel: .venv/pip
	rm -rf dist build/wheel
	$(BIN)/python -m pip wheel --quiet --no-deps --wheel-dir dist .
	$(BIN)/python tests/checks/wheel.py dist build/wheel

clean:
	rm -rf .venv .venv-lowest .venv-torch build dist docs/_build docs/generated $(QUICK)
