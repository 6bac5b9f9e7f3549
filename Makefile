# openphase needs nothing but make and a Python of 3.11 or later.
#
# The package is always installed plainly into .venv and run from there, never
# from this folder. What it needs and what it is are two steps, so that a
# changed source file costs seconds: stamps in .venv remember both.

VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
CODE := pyproject.toml README.md LICENSE __init__.py py.typed \
	$(shell find model detector optimise studies \( -type d -o -name '*.py' -o -name '*.toml' \) \
		! -name __pycache__)

# Set it to choose an interpreter: make demo PYTHON=python3.13
PYTHON ?=
PYTHONS := $(or $(PYTHON),python3 python3.13 python3.12 python3.11 python3.14 python)

# Optional parts that tests and linters see: make test EXTRAS= leaves them out.
EXTRAS ?= opendss

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help demo test lint bench clean

help:
	@echo 'make demo    install, and size the detection of the paper'\''s feeder'
	@echo 'make test    install, and run every test and every example in the docstrings'
	@echo 'make lint    ruff (rules and format) and mypy'
	@echo 'make bench   measure the engine'
	@echo 'make clean   remove .venv and what builds and checks leave; runs/ stays'

# 3 is an answer too: "sized, but some section stays without proven settings".
demo: $(VENV)/installed
	@echo '$(BIN)/openphase size paper --yes'
	@$(BIN)/openphase size paper --yes || test $$? -eq 3

test: $(VENV)/needs-test $(VENV)/installed
	MPLBACKEND=agg $(BIN)/pytest tests
	MPLBACKEND=agg $(BIN)/pytest --doctest-modules --pyargs openphase

lint: $(VENV)/needs-dev $(VENV)/installed
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy -p openphase

bench: $(VENV)/installed
	$(BIN)/python benchmarks/bench_engine.py

clean:
	rm -rf $(VENV) build dist *.egg-info .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The first interpreter that is new enough and can make environments.
$(VENV)/made:
	@try='import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))'; \
	for python in $(PYTHONS); do \
		if "$$python" -c "$$try" >/dev/null 2>&1; then \
			echo "Making $(VENV) with $$("$$python" --version)"; \
			"$$python" -m venv --clear $(VENV) && touch $@; exit; \
		fi; \
	done; \
	echo 'openphase needs Python 3.11 or later, with its venv module; none was found among:' >&2; \
	echo '  $(PYTHONS)' >&2; \
	echo 'Install one (on Debian and Ubuntu: python3 and python3-venv), or name one:' >&2; \
	echo '  make demo PYTHON=/path/to/python3' >&2; \
	exit 1

# needs-run, needs-test, needs-dev: the build tool and the dependencies, at the tested versions.
define LIST_NEEDS
import sys, tomllib
house = tomllib.load(open("pyproject.toml", "rb"))
extras = house["project"]["optional-dependencies"]
needs = house["build-system"]["requires"] + house["project"]["dependencies"]
for extra in {"run": [], "test": ["test"], "dev": ["test", "dev"]}[sys.argv[1]] + sys.argv[2:]:
    needs += [need for need in extras[extra] if not need.startswith("openphase[")]
print(*needs, sep="\n")
endef
export LIST_NEEDS

$(VENV)/needs-%: pyproject.toml constraints.txt | $(VENV)/made
	@$(BIN)/python -c "$$LIST_NEEDS" $* $(if $(filter run,$*),,$(EXTRAS)) > $@.txt
	$(PIP) install -c constraints.txt -r $@.txt
	@touch $@

# pip builds in the tree, and would install what an earlier build left behind.
$(VENV)/installed: $(CODE) | $(VENV)/needs-run
	@rm -rf build *.egg-info
	$(PIP) install --no-deps --no-build-isolation .
	@rm -rf build *.egg-info
	@touch $@
