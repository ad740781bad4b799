# RSRL: `make demo` and `make test` do all their own set-up, in .venv, from the pinned packages of requirements.txt.
# They need Python 3.11 or later, make and a package index; another interpreter: `make PYTHON=/path/to/python demo`.

.DEFAULT_GOAL := help
.PHONY: help setup demo test test-lowest lint format docs figures bench requirements clean

PYTHON ?=
VENV := .venv
LOWEST := .venv-lowest
BIN := $(VENV)/bin
STAMP := $(VENV)/.set-up
PIP := $(BIN)/python -m pip --quiet --quiet --disable-pip-version-check --no-input
WORKERS ?= 2

help:  ## List what there is to make
	@grep -E '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/make \1 \t\2/' | expand -t 20

demo: $(STAMP)  ## Train for half a minute, then show the leaderboard of Bahrain 2023
	@$(BIN)/rsrl demo

test: lint docs  ## Everything that must hold: lint, types, documentation and tests
	@$(BIN)/python tests/warm_up.py
	@$(BIN)/python -m pytest -n $(WORKERS) --quiet

test-lowest: $(STAMP)  ## The fast tests with the lowest version of every dependency that pyproject.toml allows, in .venv-lowest
	@$(BIN)/python -m venv --clear $(LOWEST)
	@$(BIN)/python benchmarks/lowest.py > $(LOWEST)/requirements.txt
	@$(LOWEST)/bin/python -m pip --quiet --disable-pip-version-check --no-input install --requirement $(LOWEST)/requirements.txt
	@PYTHONPATH=$(CURDIR)/src $(LOWEST)/bin/python -m pytest -n $(WORKERS) --quiet -m "not slow" -W ignore::DeprecationWarning  # of newer packages

lint: $(STAMP)  ## Style and types only
	@$(BIN)/ruff check --quiet .
	@$(BIN)/ruff format --check --quiet . || { echo "not formatted; run: make format" >&2; exit 1; }
	@$(BIN)/mypy --no-error-summary

format: $(STAMP)  ## Rewrite the code in the house style
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

docs: $(STAMP)  ## Build the documentation in docs/_build, warnings as errors
	@$(BIN)/python benchmarks/tables.py --check
	@$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build

figures: $(STAMP)  ## Draw the figures of README and docs that need no real laps
	@$(BIN)/python benchmarks/figures.py

bench: $(STAMP)  ## Measure simulator, environment, training and decision on this machine
	@$(BIN)/rsrl bench

setup: $(STAMP)  ## Make .venv; the others call it themselves
	@:

requirements: $(STAMP)  ## Pin the packages of pyproject.toml anew, keeping the pins that still fit
	@$(PIP) install pip-tools
	@$(BIN)/pip-compile --quiet --strip-extras --extra dev --extra docs --no-header --no-emit-index-url --no-emit-find-links \
		--no-emit-trusted-host --output-file requirements.txt pyproject.toml

clean:  ## Remove .venv and what the tools left behind
	@rm -rf $(VENV) $(LOWEST) .mypy_cache .pytest_cache .ruff_cache .hypothesis build dist docs/_build

# The stamp is touched last, so that a set-up cut short is done again.
$(STAMP): requirements.txt pyproject.toml
	@set -e; \
	for python in $(or $(PYTHON),python3.11 python3.12 python3.13 python3 python); do \
		if $$python -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1; then found=$$python; break; fi; \
	done; \
	if [ -z "$$found" ]; then echo "make: no Python 3.11 or later found; name one: make PYTHON=/path/to/python $(MAKECMDGOALS)" >&2; exit 2; fi; \
	echo "Setting up $(VENV) with $$found and the pinned packages; this takes a few minutes, once." >&2; \
	$$found -m venv $(VENV)
	@$(PIP) install --requirement requirements.txt
	@$(PIP) install --no-deps --no-build-isolation --editable .
	@touch $@
