# make report   check, bench and write report/index.html
# make test     the tests, a few minutes; `make test-all` adds the heavy sweeps, and the borders of
#               public functions with kernels that check their indices
# make peers    install the solvers of others as well, for `make bench`: all that this Python has
#               wheels of; 4 GB on Linux x86-64
# make lint     ruff and mypy
# make bench    every benchmark at full length, then the report
# make sample   every benchmark, quick, with every peer and four seeds, as docs/sample
# make docs     the documentation, as a site in build/docs that works offline
# make drawing  draw the pictures of docs/ anew, the architecture's from the imports
# make messages renew the translations of `plumbob verify` from its sentences
# make dictionary    compute anew what changes of right programs answer, some CPU minutes
# make locks    renew the lock files after a change of pyproject.toml; UPGRADE=--upgrade
#               takes the newest versions of everything
# make clean    remove everything made here
#
# make wheels        do the locks install from wheels alone on Python 3.11 to 3.14, x86 and ARM?
# make test-pythons  the tests on every one of these Pythons that this machine has
# make test-lowest   the tests with the lowest versions that pyproject.toml allows
#
# Each does all its own set-up in .venv and build; nothing but Python 3.11 to 3.14 is needed.

PYTHON ?= python3
BIN := .venv/bin
# Each core begins with its share of the files, so that most fixtures are made once, and takes tests
# from the others at the end, so that none waits for a long file (as it does by loadfile).
PARALLEL = -n auto --dist worksteal
# Kept bytecode saves two seconds in each of the hundreds of processes that the tests start.
export PYTHONDONTWRITEBYTECODE :=
# The pins are made and checked by uv, in an environment of its own; no Python is downloaded.
UV ?= build/uv/bin/uv
export UV_PYTHON_DOWNLOADS := never

.PHONY: help report test test-all peers lint bench sample docs drawing messages dictionary locks wheels test-pythons test-lowest clean

help:
	@sed -n 's/^# \{0,1\}//p' $(MAKEFILE_LIST)

report: .venv/installed
	$(BIN)/plumbob

test: .venv/installed
	$(BIN)/python -m pytest $(PARALLEL)

test-all: .venv/installed
	$(BIN)/python -m pytest $(PARALLEL) -m "slow or not slow"
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(CURDIR)/build/bounds \
	    $(BIN)/python -m pytest $(PARALLEL) tests/test_borders.py

peers: .venv/peers/installed

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: .venv/installed
	$(BIN)/plumbob bench
	$(BIN)/plumbob report

sample: .venv/peers/installed
	$(BIN)/plumbob bench --quick --seeds 4 --output build/sample
	$(BIN)/python tools/write_sample.py build/sample

docs: .venv/docs-installed
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet -b html docs build/docs

drawing: .venv/installed
	$(BIN)/python tools/draw_architecture.py
	$(BIN)/python tools/draw_lab.py
	$(BIN)/python tools/draw_gallery.py

messages: .venv/installed
	$(BIN)/python tools/translate.py

dictionary: .venv/installed
	$(BIN)/python tools/write_dictionary.py

.venv/installed: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and \
	    "Plumbob needs Python 3.11 or newer, this is " + sys.version.split()[0] + \
	    ": try make PYTHON=python3.11")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile \
	    --only-binary :all: --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

.venv/docs-installed: requirements-docs.lock .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --only-binary :all: --require-hashes -r requirements-docs.lock
	@touch $@

# PlaCo's wheels pin a Pinocchio older than ours: it has an environment of its own.
.venv/peers/installed: requirements-peers.lock requirements-placo.lock .venv/installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	    --only-binary :all: --require-hashes -r requirements-peers.lock
	$(PYTHON) -m venv .venv/peers/placo
	.venv/peers/placo/bin/python -m pip install --quiet --disable-pip-version-check \
	    --only-binary :all: --require-hashes -r requirements-placo.lock
	@touch $@

PINS = --universal --python-version 3.11 --generate-hashes --only-binary :all: \
    --no-header --no-emit-index-url --quiet $(UPGRADE)
COMPILE = $(UV) pip compile pyproject.toml $(PINS)

locks: $(UV)
	$(COMPILE) --extra robots --extra test -o requirements.lock
	$(COMPILE) --extra docs -c requirements.lock -o requirements-docs.lock
	$(COMPILE) --all-extras -c requirements.lock -o requirements-peers.lock
	$(UV) pip compile --group pyproject.toml:placo $(PINS) -o requirements-placo.lock

wheels: $(UV)
	UV=$(UV) $(PYTHON) .ci/pythons.py wheels

test-pythons:
	$(PYTHON) .ci/pythons.py tests $(PYTEST)

test-lowest: $(UV)
	UV=$(UV) $(PYTHON) .ci/pythons.py lowest $(PYTEST)

build/uv/bin/uv:
	$(PYTHON) -m venv build/uv
	build/uv/bin/python -m pip install --quiet --disable-pip-version-check uv

clean:
	rm -rf .venv report build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
