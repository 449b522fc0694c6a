# Every target sets up what it needs, from Python 3.11 or newer alone; uv is used when it is there.

VENV ?= .venv
PYTHON ?=
ARGS ?=
PAGE ?=
SUITE ?= fuzz

BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
RUN := "$(BIN)/python"
# Stamps of tools/setup.sh: phasmid runs; the developer's packages are there, too.
READY := $(VENV)/.ready
DEVELOP := $(VENV)/.develop

# A copied or moved folder, or a Python that has gone, asks for a new set-up.
ifneq ($(shell cat "$(READY)" 2>/dev/null && $(RUN) -c "" 2>/dev/null && echo works),$(CURDIR) works)
.PHONY: $(READY)
endif

# Many containers set this. Without kept bytecode each start of Python compiles its imports: a
# command takes twice as long, and the tests start hundreds of them.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help setup walk studio test golden lint docs pages bench slow dist lock ground clean \
	slow-tests slow-fuzz slow-mutations slow-learning slow-shapes slow-bus

help: ## list the targets
	@echo "make TARGET [ARGS=...] [PYTHON=python3.12] [VENV=.venv]"
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-8s %s\n", $$1, $$2 }' Makefile

setup: $(READY) ## make the virtual environment that phasmid runs in, from the locked versions
	@echo "$(VENV) is ready"

walk: $(READY) ## run the paper's walk into results/paper
	@"$(BIN)/phasmid" walk --out results/paper --force $(ARGS)

studio: $(READY) ## open the live page: the robot walking, to be driven in the browser
	@"$(BIN)/phasmid" studio $(ARGS)

PYTEST = $(RUN) -m pytest -n auto --maxprocesses 4 --dist worksteal

LINT = echo "== lint" && "$(BIN)/ruff" check . && "$(BIN)/ruff" format --check . && \
	"$(BIN)/codespell" && \
	echo "== types" && "$(BIN)/mypy" --no-error-summary && \
	echo "== layers" && "$(BIN)/lint-imports" --no-logo

# What the linters print is shown if they fail.
test: $(DEVELOP) ## run the tests, the linters beside them
	@echo "== tests, lint, types and layers"
	@{ $(LINT); } >"$(VENV)/lint.log" 2>&1 & lint=$$!; \
	$(PYTEST) -m "not slow" $(ARGS); status=$$?; \
	wait $$lint || { cat "$(VENV)/lint.log" >&2; status=1; }; \
	exit $$status

golden: $(DEVELOP) ## compare golden runs with stored figures, or with a commit (ARGS="--against HEAD~1")
	@$(RUN) tools/golden_runs.py $(ARGS)

ground: $(READY) ## compare passes on unknown ground with a commit's (ARGS="--quick --against HEAD~1")
	@$(RUN) tools/ground.py $(ARGS)

lint: $(DEVELOP) ## check style, types and layers
	@$(LINT)

docs: $(DEVELOP) ## build the documentation site into results/site
	@$(RUN) tools/build_site.py $(ARGS)

pages: $(DEVELOP) ## write pages with measured tables and pictures anew (PAGE=list names them)
	@$(RUN) tools/pages $(PAGE) $(ARGS)

bench: $(DEVELOP) ## measure how fast it is
	@for name in run kernels update drive page; do $(RUN) benchmarks/$$name.py || exit; done

slow: slow-$(SUITE) ## run a long suite: SUITE=tests, fuzz, mutations, learning, shapes or bus

slow-tests: $(DEVELOP)
	@$(PYTEST) -m slow $(ARGS)

slow-fuzz: $(DEVELOP)
	@FUZZ_FILES=2000 $(RUN) -m pytest tests/formats/test_fuzz.py $(ARGS)
	@$(RUN) tools/fuzz/bad_input.py
	@$(RUN) tools/fuzz/signals.py

slow-mutations: $(DEVELOP)
	@$(RUN) tools/golden_mutations.py $(ARGS)

slow-learning: $(DEVELOP)
	@sh tools/setup.sh learn "$(VENV)"
	@$(RUN) -m pytest tests/learning/training $(ARGS)

slow-shapes: $(DEVELOP)
	@$(PYTEST) --shapes $(ARGS)

slow-bus: $(DEVELOP)
	@PHASMID_FAULT_SEEDS=20 $(RUN) -m pytest tests/hardware/test_driver.py \
		tests/hardware/test_torque_truth.py tests/hardware/kills_on_bus.py -k "fault_ends or true or kill" $(ARGS)

dist: $(DEVELOP) ## build the source archive and the wheel into dist, equal for equal sources
	@rm -rf dist
	@SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) $(RUN) -m hatchling build -d dist

UV_LOCK = uv pip compile --quiet --universal --python-version 3.11 --only-binary :all: \
	--generate-hashes --no-header --no-annotate --no-emit-index-url --no-emit-find-links

lock: ## lock the dependencies anew (needs uv; ARGS=--upgrade for newer versions)
	@command -v uv >/dev/null || { echo "make lock needs uv."; exit 1; }
	$(UV_LOCK) $(ARGS) pyproject.toml --extra studio --output-file requirements/run.txt >/dev/null
	$(UV_LOCK) $(ARGS) pyproject.toml --extra dev --constraint requirements/run.txt \
		--output-file requirements/dev.txt >/dev/null
	$(UV_LOCK) $(ARGS) --group build --constraint requirements/dev.txt \
		--output-file requirements/build.txt >/dev/null

clean: ## remove the virtual environment, caches and builds; results stay
	@if [ -f "$(VENV)/pyvenv.cfg" ]; then rm -rf "$(VENV)"; fi
	@rm -rf .grimp_cache .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache build dist
	@find src tests examples benchmarks tools -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true

$(READY): pyproject.toml requirements/run.txt requirements/build.txt
	@sh tools/setup.sh run "$(VENV)" "$(PYTHON)"

$(DEVELOP): $(READY) requirements/dev.txt
	@sh tools/setup.sh dev "$(VENV)"
