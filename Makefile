# `make study` and `make test` do all the set-up on a fresh machine with Python 3.11+ and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
# Where Python is told not to keep compiled code, what is there already is used all the same.
COMPILE := $(BIN)/python -m compileall -q protocols equalizer analysis study

# Small matrices: threads of a linear algebra library would wait for each other longer than they work.
export OPENBLAS_NUM_THREADS ?= 1
# Some machines forbid Python to keep compiled code: then each of the hundreds of programs that the tests start compiles
# numba, pandas and SciPy anew, for seconds.
unexport PYTHONDONTWRITEBYTECODE

DIAGNOSIS := tests/stories/test_missing_physics_is_named.py \
	tests/stories/test_friction_is_named_and_then_compensated.py tests/analysis
# The tests in parts; `rest` is every test that no other part has. Parts with a clock or a screen sleep half of their
# time and must wake up at once: they start first, and what computes gives way to them, the longest first.
real_time := $(shell grep -rl --include='test_*.py' 'mark.real_time' tests)
workflows := tests/study/workflows
evaluation := tests/study/evaluation
screens := tests/study/tui
stories := tests/stories tests/contracts
equalizer := tests/equalizer
analysis := tests/analysis
PARTS := screens workflows evaluation equalizer stories analysis
rest := tests $(foreach part,$(PARTS),$(addprefix --ignore=,$($(part))))
TESTED := $(addprefix tested-,real_time screens analysis workflows rest evaluation equalizer stories)
JOBS ?= $(shell expr $$(getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2) + 2)
MARKED := not slow and not real_time
tested-real_time: MARKED := real_time and not slow
tested-real_time tested-screens: GIVE_WAY :=
GIVE_WAY := nice -n 10
CASES ?= 600
SEED ?= 95000
STUDIES ?= 400
COUNTED ?= build/calibration
SECONDS_OF_WORK ?= 600
TROUBLES ?= 200
BANK ?= bank-$(SEED)

.DEFAULT_GOAL := help
.PHONY: help study test check fix bench prove prove-study prove-equalizer prove-diagnosis prove-bank prove-troubles prove-browser prove-formats coverage calibration docs site clean \
	types imports compiled $(TESTED)

help: ## Show what can be made
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

study: $(VENV)/.installed ## Set up, then take the study (without a terminal: a simulated participant takes it)
	$(BIN)/hapteq study

test: $(VENV)/.installed-test ## Set up, then run all checks and tests (JOBS=4: so many at once; else two more than cores)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	@# One that fails stops none of the others, and fails the whole.
	@$(MAKE) --no-print-directory --keep-going --jobs=$(JOBS) $(TESTED) types imports

types:
	$(GIVE_WAY) $(BIN)/mypy

imports:
	$(GIVE_WAY) $(BIN)/lint-imports

compiled:
	@# Numba's code lies beside the sources: compiled once here, else each part would do it for itself.
	$(BIN)/python tests/compile_kernels.py

$(TESTED): tested-%: | compiled
	$(GIVE_WAY) $(BIN)/python -m pytest -m "$(MARKED)" -p no:cacheprovider $($*)

check: $(VENV)/.installed-test ## Format, lint, types and import contracts: the fast half of `make test`
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	@$(MAKE) --no-print-directory types imports

fix: $(VENV)/.installed-test ## Let ruff format and mend what it can
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(VENV)/.installed-test ## Ours against the same work done plainly and against live peers; prints ratios
	@# Peers are installed once, in .venv-peers. A bar that is missed does not hide the other benchmarks.
	@missed=0; for file in tests/benchmarks/bench_*.py; do echo "== $$file"; $(BIN)/python $$file || missed=1; done; exit $$missed

prove: prove-study prove-equalizer prove-diagnosis ## All tests marked slow, which `make test` leaves out

prove-study: $(VENV)/.installed-test ## The slow tests of study and statistics: 100 sessions killed at random, calibration of the analysis
	$(BIN)/python -m pytest -m slow tests/study tests/stories tests/protocols tests/contracts tests/project tests/references tests/benchmarks \
		tests/analysis/psychophysics $(DIAGNOSIS:%=--ignore=%)

prove-equalizer: $(VENV)/.installed-test ## The slow tests of the equalizer: many noise seeds, worst case
	$(BIN)/python -m pytest -m slow -s tests/equalizer tests/stories/test_the_device_is_equalized.py

prove-diagnosis: $(VENV)/.installed-test ## The slow tests of the diagnosis, effect by effect
	$(BIN)/python -m pytest -m slow $(DIAGNOSIS)

prove-bank: $(VENV)/.installed-prove ## The blind proof of the diagnosis (CASES=600 SEED=95000 BANK=DIR); repeated, it goes on
	$(BIN)/hapteq prove --controls --cases $(CASES) --seed $(SEED) --out $(BANK) --table docs/proof/bank-$(SEED).csv

prove-troubles: $(VENV)/.installed-test ## Whole sessions on the driver's stub, screen, engine, loop and sensors killed and stalled (TROUBLES=200)
	TROUBLES=$(TROUBLES) $(BIN)/python -m pytest -m slow -s tests/stories/test_random_troubles_of_a_study.py

prove-browser: $(VENV)/.installed-test ## A whole session in headless Chromium (the system's package chromium), by keys
	$(BIN)/python -m pytest -m slow tests/stories/test_a_study_in_a_browser.py

prove-formats: $(VENV)/.installed-test ## Exported datasets before the validator of BIDS, which is installed first (120 MB)
	$(PIP) install --quiet -c constraints.txt -e '.[validators]'
	$(BIN)/python -m pytest tests/study/cli/test_format_validators.py

coverage: $(VENV)/.installed-test ## Coverage of every interval of a report near the cap, counted anew (STUDIES=400)
	$(BIN)/python tests/references/coverage_of_analyses.py $(STUDIES)

calibration: $(VENV)/.installed-test ## Type-1 errors and ranks of the primary analysis, counted (SECONDS_OF_WORK=600); repeated, it goes on
	$(BIN)/python tests/references/primary_analysis_calibration.py $(COUNTED) $(SECONDS_OF_WORK)

docs: $(VENV)/.installed ## Make docs/formats.md and the schemas again from the code
	$(BIN)/python -m study.workflows.files.format_docs docs

$(VENV)/.installed-prove: $(VENV)/.installed
	@echo "Installing the second physics engine"
	@$(PIP) install --quiet -c constraints.txt -e '.[prove]'
	@touch $@

site: $(VENV)/.installed ## Set up, then build the pages of docs/ and the reference of the Python interface in build/site
	$(PIP) install -q -c constraints.txt -e ".[site]"
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build -q -f docs/site/mkdocs.yml
	@echo "The site: build/site/index.html"

clean: ## Remove the environment and all caches
	rm -rf $(VENV) .venv-peers .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "hapteq needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) -V). Try: make study PYTHON=python3.12"; exit 1; }
	@echo "Setting up $(VENV) (once)"
	@$(PYTHON) -m venv $(VENV)

$(VENV)/.installed: $(VENV)/bin/python pyproject.toml constraints.txt
	@echo "Installing hapteq and what it needs (a minute or two)"
	@$(PIP) install --quiet -c constraints.txt -e .
	@$(COMPILE)
	@touch $@

# Not after the plain installation: both at once are quicker than one after the other. What is imported compiles itself
# then; to compile all that is installed takes longer than all of that.
$(VENV)/.installed-test: $(VENV)/bin/python pyproject.toml constraints.txt
	@echo "Installing hapteq, what it needs and the test tools (a minute or two)"
	@$(PIP) install --quiet --no-compile -c constraints.txt -e '.[test]'
	@# Tests compile a stub of the vendor's library and exported controllers: by the system's compilers, else by pip's.
	@{ command -v cc || command -v gcc || command -v clang; } >/dev/null && \
		{ command -v c++ || command -v g++ || command -v clang++; } >/dev/null || \
		$(PIP) install --quiet -c constraints.txt -e '.[compiler]'
	@$(COMPILE)
	@touch $(VENV)/.installed $@
