# Everything a newcomer needs: `make demo` and `make test`. Both make .venv first.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
LOWEST := .venv-lowest
EXTRAS := .[cluster,dev,docs,judges,onnx,physical,tensorboard]
DEMO ?= demo
LINTED := src tests scripts benchmarks examples docs/conf.py docs/extensions docs/notebooks
PYTEST := -m pytest -n auto
SPHINX := -m sphinx --fail-on-warning --keep-going --quiet --doctree-dir docs/_build/doctrees
# A file's tests share what they prepare; files with slow tests begin first (tests/conftest.py).
BY_FILE := --dist loadfile --no-loadscope-reorder
FUZZ_EXAMPLES ?= 5000
FAULTS ?= 20
COVERAGE ?= --cov --cov-report=term:skip-covered

.PHONY: help demo test check docs links fuzz faults lowest rigs bench clean

help:
	@echo "make demo   install, identify the eye, train a saccade policy (minutes), picture and recording in $(DEMO)/"
	@echo "make test   install and run all tests, with coverage of lines and branches; make test COVERAGE= is faster"
	@echo "make check  ruff and the type checker"
	@echo "make docs   the documentation as a site, its notebooks run: docs/_build/html; a warning or a broken link fails"
	@echo "make links  the site's links to the outside, which needs the network"
	@echo "make fuzz   $(FUZZ_EXAMPLES) inputs for each reader and public function, and a table of what held; FUZZ_EXAMPLES=..."
	@echo "make faults $(FAULTS) kills and full disks of each kind for every command, and a table of what held; FAULTS=..."
	@echo "make lowest fast tests with the lowest versions that pyproject.toml allows, in $(LOWEST) (downloads 4 GB)"
	@echo "make rigs   thirty simulated rigs, from their recorded steps to a command that they perform (an hour)"
	@echo "make bench  speed of the plants and of the learning, start-up, and how cost grows (fifteen minutes)"

$(INSTALLED): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --constraint constraints.txt torch==2.13.0
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable "$(EXTRAS)"
	@touch $(INSTALLED)

demo: $(INSTALLED)
	@if [ -e "$(DEMO)" ]; then echo "$(DEMO)/ is there already; move it away, or make demo DEMO=another-folder"; exit 2; fi
	$(BIN)/orient-eye sysid --out $(DEMO)/sysid
	$(BIN)/orient-eye train --surrogate $(DEMO)/sysid/surrogate.json --evaluation-pairs 100 --out $(DEMO)/train
	@echo
	@echo "Look at:"
	@echo "  $(DEMO)/sysid/figure_3_5.png    gain K and cut-off w0 of the eye against step amplitude"
	@echo "  $(DEMO)/train/policy.png        what the policy learned, beside the searched optimum; the main sequence"
	@echo "  $(BIN)/orient-eye view $(DEMO)/train/recording.rrd    the saccades in 3-D, at several stages of training"

test: $(INSTALLED)
	$(BIN)/python $(PYTEST) $(BY_FILE) $(COVERAGE)

check: $(INSTALLED)
	$(BIN)/ruff check $(LINTED)
	$(BIN)/ruff format --check $(LINTED)
	$(BIN)/mypy

docs: $(INSTALLED)
	$(BIN)/python $(SPHINX) --builder html docs docs/_build/html

links: $(INSTALLED)
	$(BIN)/python $(SPHINX) --builder linkcheck docs docs/_build/links

fuzz: $(INSTALLED)
	FUZZ_EXAMPLES=$(FUZZ_EXAMPLES) $(BIN)/python $(PYTEST) tests/test_fuzz_*.py

faults: $(INSTALLED)
	FAULTS=$(FAULTS) $(BIN)/python $(PYTEST) tests/test_faults_*.py tests/test_checkpoint.py

$(LOWEST)/.installed: pyproject.toml
	$(PYTHON) -m venv --clear $(LOWEST)
	$(LOWEST)/bin/python -m pip install --quiet uv
	$(LOWEST)/bin/uv pip install --quiet --python $(LOWEST)/bin/python --resolution lowest-direct --editable "$(EXTRAS)"
	@touch $@

lowest: $(LOWEST)/.installed
	$(LOWEST)/bin/python $(PYTEST) $(BY_FILE) -m "not slow"

rigs: $(INSTALLED)
	RIGS=10 $(BIN)/python -m pytest -n 2 -rP tests/test_rigs.py

bench: $(INSTALLED)
	$(BIN)/python benchmarks/plants.py
	$(BIN)/python benchmarks/learning.py
	$(BIN)/python benchmarks/learning.py --profile
	$(BIN)/python benchmarks/startup.py
	$(BIN)/python benchmarks/growth.py
	$(BIN)/python benchmarks/sweeps.py

clean:
	rm -rf $(VENV) $(LOWEST) $(DEMO) docs/_build docs/elsewhere docs/reference/*/ .coverage .pytest_cache .mypy_cache .ruff_cache .hypothesis
