# Two commands set everything up on a fresh machine: `make demo` and `make test`.
PYTHON ?= python3
VENV ?= .venv
BIN = $(VENV)/bin
INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

BLENDER = .venv-blender/bin/python
NEWTON = .venv-newton/bin/python

# the engines that the simulator is compared with, installed by `make judges-install` (docs/ground_truth.md)
ifneq ($(wildcard $(BLENDER)),)
export HEMLINE_BLENDER_PYTHON ?= $(abspath $(BLENDER))
endif
ifneq ($(wildcard $(NEWTON)),)
export HEMLINE_NEWTON_PYTHON ?= $(abspath $(NEWTON))
endif

.PHONY: demo demo-from-nothing test test-all test-pythons test-dist check site bench kernels dist judges judges-install blender-extension clean

$(VENV)/.base: pyproject.toml constraints.txt kernels/pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --editable . --editable ./kernels
	touch $@

$(VENV)/.learn: $(VENV)/.base
	$(INSTALL) --editable '.[learn]'
	touch $@

$(VENV)/.dev: $(VENV)/.learn
	$(INSTALL) --editable '.[cluster,compressed,fbx,learn,usd,view,docs,dev]'
	touch $@

$(VENV)/.docs: $(VENV)/.base
	$(INSTALL) --editable '.[docs]'
	touch $@

# plays the shipped cape and the shipped T-shirt on three bodies: .glb, .webp and report.json in out/demo
demo: $(VENV)/.base
	$(BIN)/hemline demo --out out/demo

# simulates, fits, animates and evaluates a light cape in a few minutes
demo-from-nothing: $(VENV)/.base
	$(BIN)/hemline demo --from-nothing --out out/demo-from-nothing

# one process per core, each with one file of tests at a time, as fixtures are shared within a file; files keep their
# order, so that no slow one comes last
test: $(VENV)/.dev
	$(BIN)/python -m pytest -m "not slow" --numprocesses auto --maxprocesses 8 --dist loadfile --no-loadscope-reorder

test-all: $(VENV)/.dev
	$(BIN)/python -m pytest

# the tests with each installed Python from 3.11 to 3.14, and once with the lowest versions that pyproject.toml allows, each
# in its own environment without PyTorch, whose tests are reported as skipped; HEMLINE_TORCH=1 includes it
test-pythons:
	$(PYTHON) tools/pythons.py

check: $(VENV)/.dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python

# the documentation as a site, in out/site/index.html
site: $(VENV)/.docs
	$(BIN)/mkdocs build --quiet --strict

# times all benchmarks of `hemline bench` on this machine, into benchmarks/results
bench: $(VENV)/.base
	$(BIN)/hemline bench --all --record benchmarks/results

# compiles all kernels in advance, for each installed Python from 3.11 to 3.14, into kernels/hemline_kernels; run it after
# a kernel has changed
kernels:
	$(PYTHON) tools/kernels.py

# wheels and source archives of hemline and hemline-kernels, in dist
dist: $(VENV)/.base
	$(INSTALL) hatchling
	rm -rf dist
	$(BIN)/python -m hatchling build -d $(abspath dist)
	cd kernels && $(abspath $(BIN))/python -m hatchling build -d $(abspath dist)

# installs what is in dist into an environment of its own, and plays the demo there
test-dist: $(VENV)/.base
	$(INSTALL) pytest
	HEMLINE_DIST=$(abspath dist) $(BIN)/python -m pytest tests/promises/test_distribution.py

# Blender's cloth (800 MB, needs Python 3.11) and Newton, each in an environment of its own
judges-install: $(BLENDER) $(NEWTON)

$(BLENDER):
	python3.11 -m venv .venv-blender
	$@ -m pip install --quiet --disable-pip-version-check 'bpy==4.5.*' 'numpy<2'

$(NEWTON):
	$(PYTHON) -m venv .venv-newton
	$@ -m pip install --quiet --disable-pip-version-check 'newton==1.8.*'

# the extension for Blender, validated by Blender's own command: out/blender/hemline-VERSION.zip
blender-extension: $(BLENDER)
	$(BLENDER) integrations/blender/build.py out/blender

# compares the simulator with Blender's cloth and Newton: figures and pictures of docs/ground_truth.md
judges: $(VENV)/.base
	$(BIN)/python -m benchmarks.reference_engines --pictures

clean:
	rm -rf $(VENV) out build dist
