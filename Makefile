# make run      create .venv, install, and run the whole pipeline; writes runs/default/report.html
# make test     create .venv, install, and run the test suite
# make test-long run the tests of more than a moment, which the CI runs after the others
# make test-all  run all tests, the slow ones too
# make install  create .venv and install labgym with all extras
# make install-locked  create .venv and install the exact environment of the published results, checked by hashes
# make lock     remake requirements.lock
# make lowest   install the oldest versions that pyproject.toml allows and run a command of every extra
# make fuzz     read 10 000 damaged and hostile files per loader; ARGS="--fuzz-seed 7 -k onnx" chooses others
# make lint     check formatting, lint, types, the import contract and the English
# make docs     regenerate the environment page and tables in docs/
# make site     build documentation, leaderboard with replays in 3D, gallery and model zoo; open runs/site/index.html
# make pictures-check  check that pictures of LabNav's episodes show robot, goal and subject (480 of them: 40 min)
# make clean    remove .venv, caches and runs
# Pass arguments with ARGS: make run ARGS="--seed 1", make test ARGS="-k layouts"
# Choose the interpreter with PYTHON: make run PYTHON=python3.12

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
ARGS ?=

.DEFAULT_GOAL := help
.PHONY: help run test test-long test-all install install-locked lock lowest fuzz lint docs site pictures-check clean

help:
	@sed -n 's/^# //p' Makefile

run: install
	$(BIN)/labgym run $(ARGS)

# Tests start hundreds of processes; byte code spares each of them the compilation of its modules. Some packages have
# templates that do not compile. Workers take files from each other only when they are idle, so that both seldom need
# the same fixture.
test: install
	@$(BIN)/python -m compileall -q -j 0 $(VENV)/lib labgym >/dev/null 2>&1 || true
	PYTHONDONTWRITEBYTECODE= $(BIN)/python -m pytest -n auto --dist worksteal $(EXTENT) $(ARGS)

test-long: EXTENT := -m "long and not slow"
test-long: test

test-all: EXTENT := -m "" --fuzz-cases 40
test-all: test

lint: install
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python .ci/language.py

fuzz: install
	$(BIN)/python -m pytest tests/fuzz -m "" --fuzz-cases 10000 --fuzz-out runs/fuzz $(ARGS)

lowest: install
	.ci/lowest

lock: install
	.ci/lock $(ARGS)

docs: install
	$(BIN)/python docs/generate.py

site: install
	$(BIN)/labgym leaderboard --out runs/site/leaderboard
	$(BIN)/python -m sphinx -q -W --keep-going -E -c docs . runs/site

pictures-check: install
	$(BIN)/python .ci/pictures $(ARGS)

install: $(STAMP)

# The stamp is written last, so an interrupted installation is resumed.
$(STAMP): pyproject.toml requirements.lock .ci/pins
	@command -v $(PYTHON) >/dev/null || { echo "labgym: error: $(PYTHON) not found; install Python 3.11 or newer, or choose another interpreter: make PYTHON=/path/to/python3" >&2; exit 2; }
	@$(PYTHON) -c 'import sys; sys.version_info >= (3, 11) or sys.exit("labgym: error: Python 3.11 or newer is required, $(PYTHON) is %d.%d; choose another interpreter: make PYTHON=python3.11" % sys.version_info[:2])'
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { echo "labgym: error: $(PYTHON) cannot create virtual environments; on Debian or Ubuntu: apt-get install python3-venv" >&2; exit 2; }
	$(BIN)/python -m pip --version >/dev/null 2>&1 || $(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python .ci/pins >$(VENV)/constraints.txt
	$(BIN)/python -m pip install --disable-pip-version-check --constraint $(VENV)/constraints.txt --editable '.[all,dev,docs]'
	@touch $@

# The packages first, each checked by its hash; then labgym itself, which needs nothing more.
install-locked:
	@$(PYTHON) -c 'import sys; sys.version_info[:2] == (3, 11) or sys.exit("labgym: error: requirements.lock is for Python 3.11, $(PYTHON) is %d.%d; choose another interpreter: make PYTHON=python3.11" % sys.version_info[:2])'
	$(PYTHON) -m venv --clear $(VENV)
	$(BIN)/python -m pip install --disable-pip-version-check --require-hashes --requirement requirements.lock
	$(BIN)/python -m pip install --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $(STAMP)

clean:
	rm -rf $(VENV) runs dist build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
