# One command for each job; `make help` lists them. All Python packages are in
# .venv. Stamp files there avoid unnecessary builds.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
MAKEFLAGS += --no-builtin-rules

PYTHON ?= python3
CARGO ?= cargo
DEMO_ARGS ?=
PROVE_ARGS ?=
MUTANTS_ARGS ?=
PYTEST_ARGS ?= --numprocesses auto --dist worksteal

VENV := .venv
BIN := $(VENV)/bin
PY := $(BIN)/python
# An active virtual environment must not receive our packages.
export VIRTUAL_ENV := $(abspath $(VENV))
unexport PYTHONPATH PYTHONHOME
# Set in many containers. Without compiled files every process of the tests compiles the packages that it imports.
unexport PYTHONDONTWRITEBYTECODE
# Without it clippy and the bindings could find different interpreters and build twice.
export PYO3_PYTHON := $(abspath $(PY))
export PIP_DISABLE_PIP_VERSION_CHECK := 1
export MPLBACKEND := Agg

# Part of the wheel, for notebooks.
PAGE := python/eft/data/explore.html

RUST_SOURCES := $(shell find src crates \( -name '*.rs' -o -name Cargo.toml -o -name build.rs \) -not -path '*/target/*' -not -path 'crates/*/tests/*') \
  Cargo.toml Cargo.lock

# Outside of the workspace.
HEADER := crates/eft-ffi/header

MSRV = $(shell sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)

.NOTPARALLEL:
.PHONY: help demo test test-rust test-python test-browser test-documents lint lint-rust lint-python header firmware boards prove mutants coverage bench docs explore dist dist-check release-check build msrv clean

help: ## List the targets
	@grep -hE '^[a-z-]+:.*##' $(firstword $(MAKEFILE_LIST)) | sed -E 's/:[^#]*## /\t/' | expand -t 14

demo: $(VENV)/.built ## Run the paper's tests: a table, figures and a report (DEMO_ARGS="--short", "--record FILE --scale X", ...)
	$(PY) -m eft.demo $(DEMO_ARGS)

build: $(VENV)/.built ## Build the package into .venv, optimized

test: $(VENV)/.made ## Build and run every host test of the code; `make docs` tests what the documents say, `make explore` the pages in Chromium
	# The packages for the Python tests are downloaded while Rust compiles. The extension comes first: its dependencies
	# compile beside eft-sim, and the Rust tests then find both built.
	$(MAKE) --no-print-directory $(VENV)/.packages & packages=$$!; \
	  $(MAKE) --no-print-directory $(VENV)/.extension test-rust && wait $$packages
	$(MAKE) --no-print-directory test-python

test-rust:
	# With eft-py, which has no Rust tests, so that the crates have the features of the extension and are built once.
	# Without the examples of the documentation, which `make docs` runs: each crate of them would be read again, one by one.
	$(CARGO) test --locked --workspace --exclude eft-benches --tests

# The tests already run on all processors. More threads for small matrices would only wait for each other.
test-python: export OPENBLAS_NUM_THREADS := 1
test-python: $(VENV)/.importable $(VENV)/.extra-test
	$(PY) -m pytest $(PYTEST_ARGS)

test-browser: $(VENV)/.importable $(VENV)/.extra-test
	$(PY) -m pytest $(PYTEST_ARGS) -rs tests/browser

test-documents: $(VENV)/.importable $(VENV)/.extra-test
	$(CARGO) test --quiet --locked --workspace --exclude eft-benches --doc
	$(PY) -m pytest $(PYTEST_ARGS) tests/documents

lint: lint-rust lint-python ## Formatting, clippy, rustdoc, licences, the C header against the sources, ruff, mypy, stubs against the module, misspelt names

lint-rust: $(VENV)/.made header
	$(CARGO) fmt --all --check
	$(CARGO) clippy --locked --workspace --all-targets -- -D warnings
	$(CARGO) clippy --locked --package eft-core --all-targets --features defmt,serde -- -D warnings
	$(CARGO) fmt --check --manifest-path $(HEADER)/Cargo.toml
	$(CARGO) clippy --locked --manifest-path $(HEADER)/Cargo.toml --target-dir target/header -- -D warnings
	$(CARGO) clippy --locked --manifest-path proofs/Cargo.toml --target-dir target/proofs -- -D warnings
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --locked --workspace --no-deps --quiet
	.ci/licences

lint-python: $(VENV)/.importable $(VENV)/.extra-lint $(VENV)/.extra-test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(PY) -m mypy.stubtest eft._native
	$(PY) -m pytest tests/python/misspelt.py

header: ## Compare the C header with the sources; `EFT_WRITE_HEADER=1 make header` writes it
	$(CARGO) run --quiet --locked --manifest-path $(HEADER)/Cargo.toml --target-dir target/header

msrv: ## Check eft-core alone with the oldest Rust that its manifest promises, and test its optional features
	rustup run "$(MSRV)" cargo check --locked --package eft-core --target-dir target/msrv
	rustup run "$(MSRV)" cargo check --locked --package eft-core --features std --target-dir target/msrv
	rustup run "$(MSRV)" cargo test --locked --package eft-core --features defmt,serde --test core wire --target-dir target/msrv

firmware: $(VENV)/.importable $(VENV)/.extra-test ## Build the Cortex-M images, run them under QEMU, budgets against measurements
	# For the loop of OpenSees, rig and processor. If it cannot be installed, the next line names the skipped tests.
	-$(BIN)/pip install --quiet --no-compile 'effective-force-testing[opensees]'
	firmware/run

boards: ## Build the firmware examples for real boards; the image for measurements on a processor also runs under QEMU
	firmware/boards/run

prove: $(VENV)/.extra-prove ## Prove the core's lemmas for all inputs, and refute their broken twins (PROVE_ARGS="--fast", ...)
	$(PY) proofs/prove.py $(PROVE_ARGS)

mutants: ## Change the core in small wrong ways that its tests must notice (MUTANTS_ARGS="--sample 40", ...)
	nice $(PYTHON) crates/eft-core/mutants.py $(MUTANTS_ARGS)

coverage: ## Branch coverage of the core by its tests; needs nightly Rust with llvm-tools
	nice $(PYTHON) crates/eft-core/coverage.py

bench: $(VENV)/.built $(VENV)/.extra-bench ## Measure: criterion, and the package against its peers; writes docs/evidence/performance.md
	$(CARGO) bench --locked --package eft-benches
	$(PY) benches/peers/run.py benches/results.json
	$(PY) benches/peers/page.py benches/results.json docs/evidence

docs: $(VENV)/.built $(VENV)/.extra-docs test-documents ## Test what documents, examples and studies say, and build the documentation, warnings are errors; with the page of `make explore` where it was made
	$(PY) docs/reference/generate.py
	$(PY) docs/evidence/generate.py
	$(PY) docs/pictures.py
	$(PY) -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "docs/_build/html/index.html"

explore: $(PAGE) test-browser ## Make the virtual rig as one page for a browser and for notebooks, docs/_explore/eft.html, and test it and the charts of reports in Chromium

$(PAGE): $(VENV)/.made $(RUST_SOURCES) crates/eft-web/page/build.py crates/eft-web/page/explore.html
	$(CARGO) build --locked --profile web --target wasm32-unknown-unknown --package eft-web --lib
	$(BIN)/pip install --quiet 'zopfli>=0.2,<1'
	$(PY) crates/eft-web/page/build.py target/wasm32-unknown-unknown/web/eft_web.wasm $@
	mkdir -p docs/_explore && cp $@ docs/_explore/eft.html

dist: $(VENV)/.made $(PAGE) ## Build the wheel and the source distribution
	rm -rf dist
	$(BIN)/maturin build --release --locked --out dist
	$(BIN)/maturin sdist --out dist

dist-check: dist ## Install both like a user, the wheel without Rust, and run a test; build the packaged crates
	.ci/dist-check

release-check: $(VENV)/.built ## Build and try the files of a release: wheels for other systems, archives of the C library
	.ci/release-check

clean: ## Remove everything that was built
	$(CARGO) clean
	rm -rf $(VENV) dist docs/_build docs/*/_generated demo-output
	rm -rf python/eft/_native*.so $(PAGE) docs/_explore

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "$(PYTHON) is older than 3.11: make PYTHON=/path/to/python3.11 ..." >&2; exit 1; }
	@command -v $(firstword $(CARGO)) >/dev/null || { \
	  echo "no Rust: install 1.89 or later from https://rustup.rs" >&2; exit 1; }
	@$(PYTHON) -m venv $(VENV) || { \
	  echo "no virtual environment: on Debian, apt-get install python3-venv" >&2; exit 1; }
	$(BIN)/pip install --quiet 'maturin>=1.9.4,<2'
	@touch $@

$(VENV)/.built: $(VENV)/.made $(RUST_SOURCES) pyproject.toml
	$(BIN)/maturin develop --release --locked
	@touch $(VENV)/.extension $(VENV)/.importable $@

# For imports only: in the profile of the Rust tests, whose libraries it shares, unless an optimized one exists. Built, but
# not installed: installation calls pip, and `make test` has one at work beside it.
$(VENV)/.extension: $(VENV)/.made $(RUST_SOURCES) pyproject.toml
	$(BIN)/maturin develop --locked --skip-install
	@rm -f $(VENV)/.built
	@touch $@

# Once: a later extension is built in its place.
$(VENV)/.importable: pyproject.toml Cargo.toml crates/eft-py/Cargo.toml | $(VENV)/.extension
	$(BIN)/maturin develop --locked
	@touch $@

$(VENV)/.packages: $(VENV)/.made pyproject.toml
	$(PY) -c 'import tomllib; p = tomllib.load(open("pyproject.toml", "rb"))["project"]; \
	  print(*p["dependencies"], *p["optional-dependencies"]["test"], sep="\n")' | $(BIN)/pip install --quiet --no-compile -r /dev/stdin
	@touch $@

$(VENV)/.extra-%: pyproject.toml | $(VENV)/.importable
	$(BIN)/pip install --quiet --no-compile 'effective-force-testing[$*]'
	@touch $@
