# `make demo` and `make test` need git, make and Python 3.11 or newer with venv; they do the rest.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: demo test check unusual hostile kills mutants benchmark schema reference samples clean

demo: .venv/installed
	$(BIN)/canopen-conformance run siko_ims360

test: check
	$(BIN)/python -m pytest tests/wire --quiet --cov=conformance.wire --cov-branch --cov-fail-under=100
	$(BIN)/python -m pytest --numprocesses=auto --dist=worksteal

check: .venv/installed-dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

unusual: .venv/installed-dev
	UNUSUAL_PART=1 UNUSUAL_SHARES=8 $(BIN)/python -m pytest tests/checks/test_unusual_devices.py --numprocesses=auto

hostile: .venv/installed-dev
	HOSTILE_RUNS=60 HOSTILE_EXAMPLES=1000 HOSTILE_FRAMES=10000000 $(BIN)/python -m pytest tests/hostile --numprocesses=auto

kills: .venv/installed-dev
	KILLS=67 $(BIN)/python -m pytest tests/recovering --numprocesses=auto

mutants: .venv/installed-dev
	$(BIN)/canopen-conformance mutants siko_ims360 --variant two-axis
	$(BIN)/canopen-conformance mutants baumer_gim140r --variant two-dimensional
	$(BIN)/canopen-conformance mutants danfoss_dst_x730 --variant xy-10

benchmark: .venv/installed-dev
	$(BIN)/python -m pytest tests/benchmarks --benchmark-enable

schema: .venv/installed-dev
	$(BIN)/python -m conformance.spec.schema

reference: .venv/installed-dev
	$(BIN)/python -m conformance.checks.reference

samples: .venv/installed-dev
	$(BIN)/python tests/running/sample_runs.py
	$(BIN)/python tests/independent/samples.py

clean:
	rm -rf .venv dist build .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache

.venv/installed: pyproject.toml
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

.venv/installed-dev: pyproject.toml .venv/installed
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	touch $@
