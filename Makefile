# make report   check, bench and write report/index.html
# make test     the tests, a few minutes; `make test-all` adds the heavy sweeps
# make lint     ruff and mypy
# make bench    every benchmark at full length, then the report
# make drawing  draw the pictures of docs/ anew, the architecture's from the imports
# make locks    renew the two lock files (needs uv)
# make clean    remove everything made here
#
# Each does all its own set-up in .venv; nothing but Python 3.11 or newer is needed.

PYTHON ?= python3
BIN := .venv/bin

.PHONY: help report test test-all lint bench drawing locks clean

help:
	@sed -n 's/^# \{0,1\}//p' $(MAKEFILE_LIST)

report: .venv/installed
	$(BIN)/plumbob

test: .venv/installed
	$(BIN)/python -m pytest

test-all: .venv/installed
	$(BIN)/python -m pytest -m "slow or not slow"

lint: .venv/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

bench: .venv/installed
	$(BIN)/plumbob bench
	$(BIN)/plumbob report

drawing: .venv/installed
	$(BIN)/python docs/draw_architecture.py
	$(BIN)/python docs/draw_lab.py

.venv/installed: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and \
	    "Plumbob needs Python 3.11 or newer, this is " + sys.version.split()[0] + \
	    ": try make PYTHON=python3.11")'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -e .
	@touch $@

COMPILE := uv pip compile pyproject.toml --universal --python-version 3.11 --generate-hashes \
    --no-header --no-emit-index-url --quiet

locks:
	$(COMPILE) --extra robots --extra fast --extra test -o requirements.lock
	$(COMPILE) --all-extras -c requirements.lock -o requirements-peers.lock

clean:
	rm -rf .venv report build *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
