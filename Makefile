# make demo   install, write a castle, its occluder and a town to out/demo, for the README's commands
# make test   format, lint, types, import contracts, tests
# make test-slow  what takes minutes: an empty kernel cache, whole sweeps, long forms, benchmarks
# make test-faults  kills, a full disk, damage, wrong clocks, slow clients (minutes)
# make test-cluster  two servers, three workers, PostgreSQL, a bucket and a Ray cluster, each killed
#             once (minutes); CLUSTER_JOBS=100 for fewer jobs than 500
# make fuzz   ten minutes of broken files and strange meshes (FUZZ_SECONDS, FUZZ_ENGINE=guided, …),
#             then how the time of reading grows with the bytes of a worst case
# make mutants  small mistakes in what promises safety: which do the tests near them miss (minutes)
# make test-pages  every look at the dashboard in a browser (minutes); `make test` takes the vital ones
# make test-blender  the Blender add-on in Blender's own module, bpy (Python 3.11)
# make serve  the HTTP service at http://127.0.0.1:8000
# make wheel  the package with its machine code, in out/wheels: who installs it compiles nothing
# make docker-check  the steps of the container image in an empty folder, without an engine (minutes)
# make docs   the documentation as a site, in out/site; open out/site/index.html
# make openapi  write openapi.yaml anew, after a change of the service's routes or schemas
# make bench  starts, speed, quality and scenes on the real assets, the service under load (long);
#             then what got slower by a quarter since the last commit

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# What is installed, each with all before it: the command, what serves it, and what tests and docs need.
COMMAND := $(VENV)/.command
SERVICE := $(VENV)/.service
READY := $(VENV)/.ready
# Python compiles a module when it is first imported.  pip would compile all that it installs, which
# takes as long as the rest of its work.
INSTALL := $(BIN)/pip install --quiet --no-compile -c constraints.txt

# What is loaded is compiled once, also where the machine is set to keep nothing.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test kernels collected test-slow test-faults test-cluster mutants test-pages test-blender fuzz check serve wheel docker-check docs openapi bench clean

demo: $(COMMAND)
	mkdir -p out/demo
	$(BIN)/python -m examples.castle out/demo/castle.glb
	$(BIN)/python -m examples.city out/demo/town.glb --buildings 60
	cp examples/castle.overrides.toml out/demo/castle_by_hand.toml
	$(BIN)/occluder simplify out/demo/castle.glb -o out/demo/castle_occluder.glb \
		--ground --budget 64 --report out/demo/report.json --pictures out/demo
	@echo "open out/demo/report.html and out/demo/castle_occluder.glb"

# Kernels are compiled once, beside the checks, and not by every process of the tests.  In a new
# clone tests are read once before, too: whoever reads them first takes three times as long.
test: $(READY)
	$(MAKE) -j 2 check kernels collected
	$(BIN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder

# An empty kernel cache, whole sweeps, statues, the service's contract at length, and every example
# of the properties, of which `make test` takes two in five: minutes.
test-slow: $(READY)
	$(BIN)/python -m pytest -m slow
	HYPOTHESIS_PROFILE=whole $(BIN)/python -m pytest -m hypothesis -n 2 --dist loadfile

# Real servers under faults, one after the other; the figures come at the end.
test-faults: $(READY)
	$(BIN)/python -m pytest -m faults -rP

test-cluster: $(READY)
	$(INSTALL) -e '.[ray]'
	$(BIN)/python -m pytest -m cluster -rP

# MUTANTS_ONLY="leases core": the files whose names hold one of these.
MUTANTS_ONLY ?= /

mutants: $(READY)
	$(BIN)/python -m tests.mutants --only $(MUTANTS_ONLY)

test-pages: $(READY)
	$(BIN)/python -m pytest -m pages -n 2 --dist loadfile tests/service/dashboard

# In an environment of its own: bpy wants an older numpy.  The command is the one of this checkout.
BLENDER_PYTHON ?= python3.11

test-blender: $(READY)
	$(BLENDER_PYTHON) -m venv $(VENV)-blender
	$(VENV)-blender/bin/pip install --quiet -c integrations/blender/constraints.txt bpy pytest
	$(VENV)-blender/bin/python -m pytest --confcutdir=tests/integrations/blender \
		tests/integrations/blender

# Plain needs nothing more; guided is libFuzzer by atheris, which Linux and macOS have.
FUZZ_SECONDS ?= 600
FUZZ_PROCESSES ?= 1
FUZZ_ENGINE ?= plain
FUZZ_SEED ?= $(shell date +%j%H%M)
FUZZ_TARGETS ?=

fuzz: $(READY)
	$(if $(filter guided,$(FUZZ_ENGINE)),$(INSTALL) -e '.[fuzz]')
	$(BIN)/python -m tests.fuzz --seconds $(FUZZ_SECONDS) --processes $(FUZZ_PROCESSES) \
		--engine $(FUZZ_ENGINE) --seed $(FUZZ_SEED) $(FUZZ_TARGETS)
	$(if $(FUZZ_TARGETS),,$(BIN)/python -m tests.fuzz.growth)

kernels: $(READY)
	$(BIN)/occluder warmup

# What cannot be read is told by the tests themselves.
collected: $(READY)
	-test -d tests/__pycache__ || $(BIN)/python -m pytest --collect-only > /dev/null

check: $(READY)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

serve: $(SERVICE)
	$(BIN)/occluder serve

wheel: $(READY)
	$(BIN)/python -m release.wheel out/wheels

docker-check:
	docker/check.sh

docs: $(READY)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict
	@echo "open out/site/index.html"

openapi: $(READY)
	$(BIN)/python -m service.openapi

bench: $(READY)
	$(INSTALL) -e '.[bench]'
	$(BIN)/python -m bench.start
	$(BIN)/python -m bench.speed
	$(BIN)/python -m bench.quality
	$(BIN)/python -m bench.scenes
	$(BIN)/python -m bench.service_load
	$(BIN)/python -m bench.slower

# Installed once, and again when what it depends on changes.  The pip that comes with an older Python
# takes twice as long to find what goes together.
$(COMMAND): pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --upgrade pip
	$(INSTALL) -e .
	touch $@

$(SERVICE): $(COMMAND)
	$(INSTALL) -e '.[service]'
	touch $@

$(READY): $(COMMAND)
	$(INSTALL) -e '.[gl,cluster,dev,docs]'
	touch $@

clean:
	rm -rf $(VENV) $(VENV)-blender out
