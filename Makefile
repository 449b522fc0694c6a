# Every target sets up what it needs, from Python 3.11 or newer alone; uv is used when it is there.

VENV ?= .venv
PYTHON ?=
ARGS ?=

BIN := $(VENV)/$(if $(filter Windows_NT,$(OS)),Scripts,bin)
# READY stamps an environment in which phasmid runs, DEVELOP one that has the developer's packages, too.
READY := $(VENV)/.ready
DEVELOP := $(VENV)/.develop

# The stamp names the folder it was made for: a copied or moved folder, or a Python that has gone,
# asks for a new set-up.
STANDS := $(shell cat "$(READY)" 2>/dev/null && "$(BIN)/python" -c "" 2>/dev/null && echo works)
ifneq ($(STANDS),$(CURDIR) works)
STANDS :=
.PHONY: $(READY)
endif

# Many containers set this. Without kept bytecode each start of Python compiles its imports: a
# command takes twice as long, and the tests start hundreds of them.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: bus-faults help setup walk docs dist studio paper errata physics terrain gaits control course gallery film portrait studies verify meshes cad test learn-setup learn shapes lint golden mutations ground bench fuzz bad-input stress signals lock clean

help: ## list the targets
	@echo "make TARGET [ARGS=...] [PYTHON=python3.12] [VENV=.venv]"
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-11s %s\n", $$1, $$2 }' Makefile

setup: $(READY) ## make the virtual environment that phasmid runs in, from the locked versions
	@echo "$(VENV) is ready"

walk: $(READY) ## run the paper's walk into results/paper
	@"$(BIN)/phasmid" walk --out results/paper --force $(ARGS)

studio: $(READY) ## open the live page: the robot walking, to be driven in the browser
	@"$(BIN)/phasmid" studio $(ARGS)

paper: $(READY) ## grade the paper anew: docs/paper.md and its figures
	@"$(BIN)/phasmid" paper --out docs --force $(ARGS)

errata: $(DEVELOP) ## derive Equation 10 and write docs/errata.md and its figures anew
	@"$(BIN)/python" docs/errata_page.py

physics: $(READY) ## compare the laws of contact anew: docs/physics.md and its figure
	@"$(BIN)/python" docs/physics_page.py

verify: $(READY) ## run the physics against closed forms and write docs/verification.md
	@"$(BIN)/phasmid" verify --page docs/verification.md --force $(ARGS)

terrain: $(READY) ## walk the terrains anew: docs/terrain.md and its pictures
	@"$(BIN)/python" docs/terrain_page.py

gaits: $(READY) ## tell and draw the gaits anew: docs/gaits.md and its picture
	@"$(BIN)/python" docs/gaits_page.py

control: $(READY) ## measure the locomotion engine anew: docs/control.md (ARGS such as --seeds 5)
	@"$(BIN)/python" docs/control_page.py $(ARGS)

cad: $(DEVELOP) ## draw the paper's robot as solids anew: docs/cad.md and its picture
	@"$(BIN)/python" docs/cad_page.py

meshes: $(DEVELOP) ## draw the presets' meshes anew (needs the extra cad)
	@"$(BIN)/python" docs/preset_meshes.py

gallery: $(READY) ## draw every figure anew: docs/gallery.md and its pictures
	@"$(BIN)/python" docs/gallery_page.py

portrait: $(DEVELOP) ## take the pictures of the live page anew (needs Chromium)
	@"$(BIN)/python" docs/studio_page.py

studies: $(DEVELOP) ## make the three studies anew and take the pictures of their pages (Chromium)
	@"$(BIN)/python" docs/studies_page.py

course: $(DEVELOP) ## film the mixed course and take the picture of its report anew (Chromium)
	@"$(BIN)/python" docs/course_film.py

film: $(DEVELOP) ## film two cycles of the paper's walk anew: docs/images/walk.gif
	@"$(BIN)/phasmid" walk --duration 4 --out results/film --no-figures --quiet --force \
		--video docs/images/walk.gif

# Not among the locked packages: PyTorch's builds differ by machine, and most take gigabytes.
TRAINERS = torch==2.13.0 stable-baselines3==2.9.2

PYTEST = "$(BIN)/python" -m pytest -n auto --maxprocesses 4 --dist worksteal

LINT = echo "== lint" && "$(BIN)/ruff" check . && "$(BIN)/ruff" format --check . && \
	"$(BIN)/codespell" && \
	echo "== types" && "$(BIN)/mypy" --no-error-summary && \
	echo "== layers" && "$(BIN)/lint-imports" --no-logo

# What the linters print is shown if they fail.
test: $(DEVELOP) ## run every check, the linters beside the tests
	@echo "== tests, lint, types and layers"
	@{ $(LINT); } >"$(VENV)/lint.log" 2>&1 & lint=$$!; \
	$(PYTEST) $(ARGS); status=$$?; \
	wait $$lint || { cat "$(VENV)/lint.log" >&2; status=1; }; \
	exit $$status

docs: $(DEVELOP) ## build the documentation site into results/site
	@"$(BIN)/python" docs/build_site.py $(ARGS)

dist: $(DEVELOP) ## build the source archive and the wheel into dist, equal for equal sources
	@rm -rf dist
	@SOURCE_DATE_EPOCH=$$(git log -1 --format=%ct) "$(BIN)/python" -m hatchling build -d dist

learn-setup: $(DEVELOP) ## install PyTorch and Stable-Baselines3, with which policies are trained
	@if command -v uv >/dev/null 2>&1; then \
		uv pip install --quiet --python "$(BIN)/python" $(TRAINERS); \
	else \
		$(PIP) --quiet $(TRAINERS); \
	fi

learn: learn-setup ## train the policy of level ground: 15 to 20 minutes on two cores (ARGS)
	@"$(BIN)/python" examples/learning/train.py $(ARGS)

shapes: $(DEVELOP) ## run the tests with array shapes and types checked at run time
	@$(PYTEST) --shapes $(ARGS)

lint: $(DEVELOP) ## check style, types and layers
	@$(LINT)

golden: $(DEVELOP) ## compare golden runs with stored figures, or with a commit (ARGS="--against HEAD~1")
	@"$(BIN)/python" tools/golden_runs.py $(ARGS)

mutations: $(DEVELOP) ## prove that the golden runs catch faults: mutate the source and run them
	@"$(BIN)/python" tools/golden_mutations.py $(ARGS)

ground: $(READY) ## compare passes on unknown ground with a commit's (ARGS="--quick --against HEAD~1")
	@"$(BIN)/python" tools/ground.py $(ARGS)

bench: $(DEVELOP) ## measure how fast it is (ARGS go to benchmarks/kernels.py, such as --samples 20000)
	@"$(BIN)/python" benchmarks/run.py
	@"$(BIN)/python" benchmarks/kernels.py $(ARGS)
	@"$(BIN)/python" benchmarks/force_solver.py
	@"$(BIN)/python" benchmarks/update.py
	@"$(BIN)/python" benchmarks/drive.py
	@"$(BIN)/python" benchmarks/page.py
	@"$(BIN)/python" benchmarks/video.py

stress: $(DEVELOP) ## kill and interrupt walks at random moments (ARGS such as --kills 10)
	@"$(BIN)/python" benchmarks/stress.py $(ARGS)

signals: $(DEVELOP) ## send 200 signals at random moments; flip 400 bits in studies (ARGS=--signals 20)
	@"$(BIN)/python" benchmarks/signals.py $(ARGS)

bus-faults: $(DEVELOP) ## drive robots on an emulated bus with faults in each stage: 2 hours (ARGS=-k=overload)
	@PHASMID_FAULT_SEEDS=20 "$(BIN)/python" -m pytest tests/hardware/test_driver.py \
		tests/hardware/test_torque_truth.py tests/hardware/kills_on_bus.py -k "fault_ends or true or kill" $(ARGS)

bad-input: $(DEVELOP) ## give bad inputs of every kind, each to be refused in one sentence (ARGS=urdf)
	@"$(BIN)/python" benchmarks/bad_input.py $(ARGS)

fuzz: $(DEVELOP) ## read 2000 damaged files per format
	@FUZZ_FILES=2000 "$(BIN)/python" -m pytest tests/formats/test_fuzz.py $(ARGS)

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
	@rm -rf .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache build dist
	@find src tests examples benchmarks tools -name __pycache__ -type d -prune -exec rm -rf {} + 2>/dev/null || true

# Installs files of locked packages, and phasmid from here. pip's files are not compiled here: what is used is, when it is
# first imported. In a terminal one line says what pip does.
INSTALL = set -e; \
	install() { \
		if command -v uv >/dev/null 2>&1; then \
			quiet=--quiet; if [ -t 1 ]; then quiet=; fi; \
			uv pip sync $$quiet --python "$(BIN)/python" --require-hashes --only-binary :all: "$$@"; \
			uv pip install --quiet --python "$(BIN)/python" --no-deps --no-build-isolation --editable .; \
			return; \
		fi; \
		for file in "$$@"; do set -- "$$@" --requirement "$$file"; shift; done; \
		{ \
			PYTHONUNBUFFERED=1 $(PIP) --progress-bar off --no-compile --require-hashes \
				--only-binary :all: "$$@" 2>"$(VENV)/pip.log" && echo "done."; \
		} | { \
			count=0; ended=1; \
			while IFS= read -r line; do \
				case $$line in \
					"Collecting "*) count=$$((count + 1)); line="$$count $${line\#Collecting }";; \
					"Installing "*) line=installing;; \
					done.) ended=0; line=;; \
					*) continue;; \
				esac; \
				if [ -t 1 ]; then printf '\r\033[K%.70s' "$${line:+   }$${line%% (*}"; fi; \
			done; \
			if [ $$ended = 1 ]; then cat "$(VENV)/pip.log" >&2; fi; \
			return $$ended; \
		}; \
		$(PIP) --quiet --quiet --no-deps --no-build-isolation --editable .; \
	}

PIP = "$(BIN)/python" -m pip --disable-pip-version-check --no-input install

# Without a valid stamp the environment is made from nothing; with one it is brought up to date.
# A stamp goes first and comes last, so that a set-up that was cut short is done again.
$(READY): pyproject.toml requirements/run.txt requirements/build.txt
	@$(INSTALL); \
	rm -f "$(READY)"; \
	if command -v uv >/dev/null 2>&1; then with=uv; else with=pip; fi; \
	if [ -z "$(STANDS)" ]; then \
		python=; \
		for candidate in $(if $(PYTHON),"$(PYTHON)",python3 python3.14 python3.13 python3.12 python3.11 python); do \
			if "$$candidate" -c "import sys; sys.exit(sys.version_info < (3, 11))" >/dev/null 2>&1; then \
				python=$$candidate; break; \
			fi; \
		done; \
		if [ -z "$$python" ]; then \
			echo "phasmid needs Python 3.11 or newer and found none$(if $(PYTHON), at $(PYTHON)); name one: make PYTHON=/path/to/python3." >&2; \
			exit 1; \
		fi; \
		if [ -e "$(VENV)" ] && [ ! -f "$(VENV)/pyvenv.cfg" ] && [ -n "$$(ls -A "$(VENV)")" ]; then \
			echo "$(VENV) holds something other than a virtual environment; name another folder: make VENV=..." >&2; \
			exit 1; \
		fi; \
		rm -rf "$(VENV)"; \
		echo "== setting up $(VENV) with $$with: some 40 packages, 0.6 GB"; \
		if [ $$with = uv ]; then \
			uv venv --quiet --python "$$("$$python" -c "import sys; print(sys.executable)")" "$(VENV)"; \
		else \
			"$$python" -m venv "$(VENV)" || { \
				echo "$$python cannot make a virtual environment; on Debian and Ubuntu, install python3-venv." >&2; \
				rm -rf "$(VENV)"; exit 1; \
			}; \
		fi; \
	else \
		echo "== bringing $(VENV) up to date with $$with"; \
	fi; \
	if [ -e "$(DEVELOP)" ]; then packages=dev; else packages=run; fi; \
	install requirements/$$packages.txt requirements/build.txt; \
	echo "$(CURDIR)" > "$(READY)"

$(DEVELOP): $(READY) requirements/dev.txt
	@$(INSTALL); \
	rm -f "$(DEVELOP)"; \
	echo "== adding the developer's packages to $(VENV): some 120, 1.6 GB"; \
	install requirements/dev.txt requirements/build.txt; \
	touch "$(DEVELOP)"
