# make bench   the main job: every method on the embedded motion, and the table
# make test    everything that is checked: ruff, mypy, the regression gate, pytest, side by side
# make docs    the site, into build/docs/site
# make release-check   the wheel and the source archive, into dist, tried with $(PYTHONS) where nothing else is
# make gpu-bundle METHODS="pan humot" [CMU=DIR] [EARLIER=DIR]   what travels to a machine with a GPU
# All make their own virtual environment in $(VENV) with the versions of constraints.txt.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV ?= .venv
PIP_OPTIONS ?=
ARGS ?=
JOBS ?= auto
PYTHONS ?= python3.11 python3.12 python3.13
METHODS ?= nkn pan humot paired

BIN := $(VENV)/bin
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile $(PIP_OPTIONS) \
	-c constraints.txt

# pip compiles none of the 11,000 files that it installs: a quarter of them is ever imported, and Python compiles
# these when they are. What it compiled is kept: tests start hundreds of processes, and each would do it anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: bench test check lint pytest format docs release release-check clean gpu-bundle

bench: $(VENV)/installed
	$(BIN)/bench run $(ARGS)

test: $(VENV)/installed-test
	$(MAKE) --jobs=3 pytest lint check

pytest: $(VENV)/installed-test
	$(BIN)/python -m pytest -n $(JOBS) --dist loadfile --no-loadscope-reorder $(ARGS)

check: $(VENV)/installed-test
	$(BIN)/bench check

lint: $(VENV)/installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/codespell

format: $(VENV)/installed-test
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(VENV)/installed-docs
	$(BIN)/python -m tools.build_docs

release: $(VENV)/installed-release
	PYTHON=$(CURDIR)/$(BIN)/python tools/build_release.sh

release-check: release
	PIP_OPTIONS='$(PIP_OPTIONS)' tools/try_release.sh $(PYTHONS)

# What Python has beside PyTorch there lacks these.
build/wheels: constraints.txt | $(VENV)/python
	$(BIN)/python -m pip download --quiet --disable-pip-version-check --dest $@ --no-deps --only-binary=:all: \
		--python-version 3.12 --implementation cp --platform manylinux_2_17_x86_64 --platform manylinux2014_x86_64 \
		-c constraints.txt pydantic pydantic-core annotated-types typing-extensions typing-inspection platformdirs
	touch $@

gpu-bundle: build/wheels
	WHEELS=build/wheels CMU='$(CMU)' EARLIER='$(EARLIER)' tools/gpu_bundle.sh build/gpu $(METHODS)

clean:
	rm -rf $(VENV) build dist *.egg-info

$(VENV)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed; say which: make PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	touch $@

$(VENV)/installed: $(VENV)/python pyproject.toml constraints.txt
	$(INSTALL) -e .
	touch $@

$(VENV)/installed-docs $(VENV)/installed-release: $(VENV)/installed-%: $(VENV)/python pyproject.toml constraints.txt
	$(INSTALL) -e '.[$*]'
	touch $@ $(VENV)/installed

$(VENV)/installed-test: $(VENV)/python pyproject.toml constraints.txt
	$(INSTALL) -e '.[test]'
	touch $@ $(VENV)/installed
