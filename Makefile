# Everything that is done to Supple, by name. `make` alone lists the names.
# Nothing needs to be set up first: each target builds what it stands on, once.

.DEFAULT_GOAL := help
.PHONY: help demo test test-slow test-cpp bench lint format build clean
.DELETE_ON_ERROR:

BIN := .venv/bin
PYTEST := $(BIN)/pytest -n auto --dist loadgroup
SOURCES := CMakeLists.txt $(shell find cpp kernels materials cmake -type f \
	\( -name '*.[ch]pp' -o -name '*.h' -o -name '*.in' -o -name '*.py' \
	-o -name '*.cmake' -o -name CMakeLists.txt \) 2>/dev/null)
CPP_FILES = $(shell find cpp tests/cpp -name '*.[ch]pp')

export PIP_DISABLE_PIP_VERSION_CHECK := 1

help: ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | awk -F ':.*## ' '{printf "  make %-10s %s\n", $$1, $$2}'

demo: .venv/.built ## predict the tumour of a synthetic patient; writes out/demo/report.html
	$(BIN)/supple demo --out out/demo

test: .venv/.built .venv/.dev ## the fast tests
	$(PYTEST) -m "not slow"

test-slow: .venv/.built .venv/.dev ## the tests that take minutes
	$(PYTEST) -m slow

test-cpp: .venv/.built ## the C++ tests, optimised and under the address and behaviour sanitizers
	for preset in release debug; do \
	  cmake --preset $$preset && cmake --build --preset $$preset && ctest --preset $$preset || exit 1; \
	done

bench: .venv/.built .venv/.dev ## the benchmarks, into benchmarks/results.md; peers by BENCH="--dolfinx …"
	$(BIN)/python benchmarks/run.py $(BENCH)

lint: .venv/.dev ## style and types, nothing is changed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	scripts/typecheck.sh
	$(if $(CPP_FILES),$(BIN)/clang-format --dry-run -Werror $(CPP_FILES))

format: .venv/.dev ## rewrite the sources in the house style
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(if $(CPP_FILES),$(BIN)/clang-format -i $(CPP_FILES))

build: .venv/.built ## compile, and install into .venv in place: edited Python needs no new build

clean: ## remove what was built, keep .venv
	rm -rf build dist .venv/.built .mypy_cache .ruff_cache .pytest_cache

.venv/.python: scripts/setup.sh
	scripts/setup.sh
	touch $@

.venv/.requirements: .venv/.python pyproject.toml scripts/requirements.py
	$(BIN)/python scripts/requirements.py > $@.txt
	$(BIN)/pip install --quiet -r $@.txt
	touch $@

.venv/.dev: .venv/.requirements
	$(BIN)/python scripts/requirements.py --dev > $@.txt
	$(BIN)/pip install --quiet -r $@.txt
	touch $@

.venv/.built: .venv/.requirements $(SOURCES)
	$(BIN)/pip install --quiet --no-deps --no-build-isolation --editable .
	touch $@
