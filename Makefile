# Every target sets itself up: it creates .venv from the lock files and reuses it.
PYTHON ?= python3
EXAMPLES ?= 500
STEPS ?= 100000
UV_VERSION := 0.13.8
ifeq ($(OS),Windows_NT)
  BIN := .venv/Scripts
  PEERS_BIN := .venv-peers/Scripts
else
  BIN := .venv/bin
  PEERS_BIN := .venv-peers/bin
endif
# uv installs in seconds; where it cannot be had or cannot reach the index, pip reads the same lock file.
# Bytecode is compiled now, also that of src, so that no later start has to (it is 1.3 s of one, and 0.4 s for src).
install = ($(BIN)/python -m uv pip install -q --compile-bytecode --python $(BIN)/python $(1) || $(BIN)/python -m pip install -q $(1))

.PHONY: demo test test-all coverage fuzz soak bench peers blender lint format docs kernels dist lock clean
.DELETE_ON_ERROR:

# Both demos compile for half a minute, once: first, on all cores. They run at the same time, and the first says at the end
# what it found. A film needs OpenGL; without it, a line says what to install.
demo: .venv/.base
	$(BIN)/supple warm squash bears
	@mkdir -p out
	@$(BIN)/supple demo squash --overwrite --output out/squash >out/squash.log 2>&1 & squash=$$!; \
	  $(BIN)/supple demo bears --overwrite --output out/bears; bears=$$?; \
	  wait $$squash; result=$$?; cat out/squash.log; exit $$((bears + result))
	-$(BIN)/supple picture out/bears
	-$(BIN)/supple export out/bears --to mp4 --output out/bears/film.mp4

# Three processes on two cores: tests of the page and of other processes wait much of their time.
test: .venv/.dev
	$(BIN)/python -m pytest -n 3 --dist worksteal --durations=30 -m "not slow"

test-all: .venv/.dev
	$(BIN)/python -m pytest -n 2 --dist worksteal --durations=30

# Which lines of Python the tests run; kernels are compiled and not counted.
coverage: .venv/.dev
	$(BIN)/python -m pytest -n 3 --dist worksteal -m "not slow" --cov=supple --cov-report=term:skip-covered

# Every reader on many thousands of damaged files, which are new ones each time; with SEED, those of an earlier run.
fuzz: .venv/.dev
	@seed=$${SEED:-$$(date +%s)}; again="The same again: make fuzz SEED=$$seed EXAMPLES=$(EXAMPLES)"; echo "$$again"; \
	  SUPPLE_FUZZ_EXAMPLES=$(EXAMPLES) $(BIN)/python -m pytest -n 2 --hypothesis-profile=new --hypothesis-seed=$$seed \
	  tests/fuzz || { echo "$$again"; exit 1; }

# A hundred thousand steps of small scenes with every solver.
soak: .venv/.dev
	SUPPLE_SOAK_STEPS=$(STEPS) $(BIN)/python -m pytest -n 2 tests/soak

# The environments of other programs, for `bench` and for `python -m benchmarks.published_against`.
peers: .venv-peers/.made .venv-superdex/.made

bench: .venv/.dev .venv-peers/.made
	$(BIN)/python -m benchmarks

lint: .venv/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/python client/build.py check

format: .venv/.dev
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The documentation site in build/site; a warning, such as a broken link, is an error.
docs: .venv/.dev
	NO_MKDOCS_2_WARNING=1 PATH=$(CURDIR)/$(BIN):$$PATH $(BIN)/python -m mkdocs build

# The add-on for Blender as a zip file to install, tested in Blender without a window (Debian: apt install blender python3-numpy).
blender: .venv/.base
	@command -v blender >/dev/null || { echo "make blender needs Blender 3.4 or newer on the path: apt install blender python3-numpy"; exit 2; }
	mkdir -p dist
	rm -rf blender/supple_addon/__pycache__
	cd blender && $(CURDIR)/$(BIN)/python -m zipfile -c ../dist/supple_blender.zip supple_addon
	BLENDER_USER_SCRIPTS=$(CURDIR)/out/blender SUPPLE_PYTHON=$(CURDIR)/$(BIN)/python blender --background \
	  --factory-startup --python-exit-code 1 --python blender/test_headless.py -- dist/supple_blender.zip

# The list of the kernels of standard scenes, and these kernels in build/kernels, compiled for most processors of this kind.
kernels: .venv/.base
	$(BIN)/python .ci/kernels.py

# The wheel and the sdist in dist/, checked: their contents, their page on an index, and a demo from the wheel alone.
dist: kernels
	SUPPLE_KERNELS=$(CURDIR)/build/kernels $(BIN)/python -m uv build -q --clear --out-dir dist
	$(BIN)/python -m uv tool run "twine>=6.2,<8" check --strict dist/*
	$(BIN)/python .ci/check_dist.py dist

# Run after changing dependencies in pyproject.toml.
lock: .venv/.dev
	$(BIN)/python -m uv pip compile -q --universal -p 3.11 --generate-hashes --no-emit-index-url --no-header \
	  --all-extras --group dev --excludes requirements/excludes.in pyproject.toml -o requirements/dev.lock
	$(BIN)/python -m uv pip compile -q --universal -p 3.11 --generate-hashes --no-emit-index-url --no-header \
	  --extra video -c requirements/dev.lock pyproject.toml -o requirements/base.lock
	$(BIN)/python -m uv pip compile -q --universal -p 3.11 --generate-hashes --no-emit-index-url --no-header \
	  requirements/peers.in -o requirements/peers.lock
	$(BIN)/python -m uv pip compile -q --universal -p 3.12 --generate-hashes --no-emit-index-url --no-header \
	  requirements/superdex.in -o requirements/superdex.lock

.venv/.made:
	$(PYTHON) -c "import sys; sys.version_info >= (3, 11) or sys.exit('Supple needs Python 3.11 or newer; set PYTHON=python3.x')"
	$(PYTHON) -m venv .venv
	-$(BIN)/python -m pip install -q uv==$(UV_VERSION)
	$(BIN)/python -c "open('.venv/.made', 'w')"

.venv/.base: .venv/.made requirements/base.lock pyproject.toml $(wildcard client/src/*) client/build.mjs client/package-lock.json
	$(call install,-r requirements/base.lock)
	$(call install,--no-deps -e .)
	$(BIN)/python -m compileall -q src
	$(BIN)/python -c "open('.venv/.base', 'w')"

.venv/.dev: .venv/.base requirements/dev.lock
	$(call install,-r requirements/dev.lock)
	$(BIN)/python -c "open('.venv/.dev', 'w')"

# The peers live in an environment of their own, so that their dependencies never meet ours.
.venv-peers/.made: .venv/.base requirements/peers.lock
	$(PYTHON) -m venv .venv-peers
	$(BIN)/python -m uv pip install -q --python $(PEERS_BIN)/python -r requirements/peers.lock \
	  || $(PEERS_BIN)/python -m pip install -q -r requirements/peers.lock
	$(BIN)/python -c "open('.venv-peers/.made', 'w')"

# SuperDex needs Python 3.12 or newer, which uv finds or fetches.
.venv-superdex/.made: .venv/.base requirements/superdex.lock
	$(BIN)/python -m uv venv -q --clear --python 3.12 .venv-superdex
	$(BIN)/python -m uv pip install -q --python $(subst peers,superdex,$(PEERS_BIN))/python -r requirements/superdex.lock
	$(BIN)/python -c "open('.venv-superdex/.made', 'w')"

clean:
	rm -rf .venv .venv-peers .venv-superdex client/node_modules src/supple/results/page/page.html out build dist .pytest_cache .ruff_cache .hypothesis
