# Every target does its own set-up, and needs only make and Python 3.11 to 3.13.
#   make serve      the service on http://HOST:PORT
#   make test       every check: lint, types, architecture, tests
#   make test-long  every check and the long tests: fuzzing, the studio page in a browser, more cases of other tests
#   make docs       the documentation site, which the service sends at /help
#   make bench      the benchmarks
#   make lock       renews the lockfiles
#   make clean      removes all generated files

PYTHON ?= python3
HOST ?= 127.0.0.1
PORT ?= 8000
# robots with kernels that are compiled before the service starts, separated by commas; the kernels of other robots are
# compiled at their first request
JOULEPATH_ROBOTS ?= ur5e
export JOULEPATH_ROBOTS
VENV := .venv
PY := $(VENV)/bin/python
MADE := $(VENV)/.made-$(notdir $(realpath $(VENV)/bin/python))
INSTALL := $(PY) scripts/install.py
STUDIO := app/static/studio
STUDIO_SOURCES := $(shell find app/studio -type f -not -path '*/node_modules/*' -not -path '*/.node/*') \
	examples/optimize/bin_to_shelf.json
HELP := app/static/help
ROS2 := build/ros2
HELP_SOURCES := $(shell find docs examples -type f -not -name '*.pyc') zensical.toml requirements-docs.lock CONTRIBUTING.md \
	joulepath/__init__.pyi scripts/build_docs.py
NATIVE := optimizer/native/libjoulepath.so.1
SOURCES := app optimizer models tests benchmarks examples scripts

# The C library of the optimiser is compiled once, and its kernels once per robot. If the machine has no C compiler, one
# is installed as a Python package.
ifeq ($(shell command -v $${CC:-cc} || command -v gcc || command -v clang),)
COMPILER := $(VENV)/bin/cc
export CC := $(abspath $(COMPILER))
endif

export PYTHONUNBUFFERED := 1
comma := ,

# Two simultaneous set-ups would install into the same environment, so the second one waits.
define SET_UP
@flock --nonblock Makefile true || echo "Another make is setting up this folder: waiting for its end ..."
@+flock Makefile $(MAKE) --no-print-directory $(1)
endef

.PHONY: serve service test test-long docs bench lock clean ready tools lint mypy style types kernels pytest pytest-long \
	vitest

serve:
	$(call SET_UP,service)
	JOULEPATH_HOST=$(HOST) PORT=$(PORT) exec $(PY) -m joulepath.app

# prepares the tests, with bytecode: the tests start many processes, which may be unable to write it
ready:
	$(call SET_UP,tools)

service: $(VENV)/.runtime $(VENV)/.package kernels

tools: $(VENV)/.runtime $(NATIVE)
	@$(MAKE) --no-print-directory --jobs=3 $(VENV)/.dev $(VENV)/.package kernels $(ROS2)/.ready
	@$(PY) -m compileall -q app optimizer models

# The linters come first, because they are faster than the tests.
test: ready
	@$(MAKE) --no-print-directory --jobs=2 mypy style types vitest $(VENV)/.bytecode
	@$(MAKE) --no-print-directory pytest

test-long: ready
	@$(MAKE) --no-print-directory --jobs=2 mypy style types vitest $(VENV)/.bytecode
	@$(MAKE) --no-print-directory pytest-long

# Every process loads all tests, so their bytecode is stored even if PYTHONDONTWRITEBYTECODE is set.
$(VENV)/.bytecode pytest pytest-long: export PYTHONDONTWRITEBYTECODE :=

# Once, for a new environment: without this target, every process would compile all tests with their rewritten
# assertions, not only those that have changed. Errors of loading are ignored here, because the tests fail later.
$(VENV)/.bytecode: $(VENV)/.dev
	@$(PY) -m pytest --collect-only -q -p no:schemathesis > /dev/null || true
	@touch $@

# `worksteal`: a process without remaining tests takes tests of another process. Only long tests need schemathesis, and
# loading it takes a second.
pytest:
	$(PY) -m pytest -n auto --dist worksteal -p no:schemathesis $(PYTEST_ARGS)

# The empty marker expression replaces the expression in pyproject.toml, which deselects long tests.
pytest-long:
	$(PY) -m pytest -n auto --dist worksteal -m "" $(PYTEST_ARGS)

lint: mypy style types

# Two processes: one alone would take longer than all other checks together.
mypy: $(VENV)/.dev
	$(PY) -m mypy --num-workers 2

style: $(VENV)/.dev
	$(PY) -m ruff check $(SOURCES)
	$(PY) -m ruff format --check $(SOURCES)
	$(VENV)/bin/lint-imports --no-logo

# The types of the studio page, and the tests of its state.
types: $(PY)
	$(PY) scripts/build_studio.py check

vitest: $(PY)
	$(PY) scripts/build_studio.py test

docs: $(PY)
	$(PY) scripts/build_docs.py

bench: $(VENV)/.benchmarks kernels
	$(PY) -m benchmarks $(BENCH_ARGS)

kernels: $(VENV)/.runtime $(NATIVE)
	@$(if $(JOULEPATH_ROBOTS),$(PY) -m joulepath.optimizer.dynamics.precompile $(subst $(comma), ,$(JOULEPATH_ROBOTS)))

# The lockfile of dev contains the packages of requirements.lock with the same versions.
$(VENV)/.runtime: requirements.lock $(PY) $(MADE)
	@$(INSTALL) $<
	@$(PY) scripts/slim.py $(VENV)
	@$(PY) scripts/link_libgomp.py
	@touch $@

# Installs the package: `joulepath` and `import joulepath` then work from any folder, with the sources in this folder.
$(VENV)/.package: pyproject.toml scripts/build_hook.py $(VENV)/.runtime $(STUDIO)/index.html $(HELP)/index.html $(NATIVE)
	@$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --editable .
	@touch $@

# The common C library of all arms. It is not recompiled for a newer Python or compiler.
$(NATIVE): $(wildcard optimizer/native/*.c) optimizer/native/build.py | $(PY) $(COMPILER)
	@echo "Compiling $@ ..."
	@$(PY) optimizer/native/build.py

# The studio page. Without Node on the machine, the script installs it as a package.
$(STUDIO)/index.html: $(STUDIO_SOURCES) scripts/build_studio.py $(PY)
	@echo "Building the studio page into $(STUDIO) ..."
	@$(PY) scripts/build_studio.py
	@touch $@

# The documentation site. The script installs its tools into a separate environment.
$(HELP)/index.html: $(HELP_SOURCES) $(PY)
	@echo "Building the pages into $(HELP) ..."
	@$(PY) scripts/build_docs.py
	@touch $@

$(VENV)/.dev: requirements-dev.lock $(VENV)/.runtime
	@$(INSTALL) $<
	@touch $@

# The ROS 2 node is tested in a separate environment on top of $(VENV), because a package of rclpy starts every Python
# of its environment a second time with other library paths.
$(ROS2)/.ready: requirements-ros2.lock $(VENV)/.dev
	@$(PY) -m venv --clear --without-pip $(ROS2)
	@$(PY) -c "import sysconfig; print('import site; site.addsitedir(%r)' % sysconfig.get_path('purelib'))" \
		> "$$($(ROS2)/bin/python -c "import sysconfig; print(sysconfig.get_path('purelib'))")/below.pth"
	@$(ROS2)/bin/python scripts/install.py $<
	@touch $@

# The other planners of the benchmarks, in the environment of the runtime.
$(VENV)/.benchmarks: requirements-benchmarks.lock $(VENV)/.runtime
	@$(INSTALL) $<
	@touch $@

$(VENV)/bin/cc: requirements-compiler.lock $(PY) $(MADE)
	@echo "No C compiler on this machine: installing one as a package ..."
	@$(INSTALL) $<
	@printf '#!/bin/sh\nexec "$${0%%/*}/python" -m ziglang cc "$$@"\n' > $@
	@chmod +x $@

# An incomplete environment has a Python, but no pip. The same is true after an update of the system's Python, because
# the new Python does not find the packages of the old one. $(MADE) replaces both.
$(PY): | $(MADE)
	@test -x $@ || $(PYTHON) scripts/bootstrap.py $(VENV)

$(MADE):
	@$(PY) -m pip --version > /dev/null 2>&1 || $(PYTHON) scripts/bootstrap.py $(VENV)
	@touch "$(VENV)/.made-$$(basename "$$(realpath $(PY))")"

LOCK = $(VENV)/bin/uv pip compile --universal --generate-hashes --no-emit-index-url --quiet \
	--custom-compile-command "make lock" $(LOCK_ARGS)

# With LOCK_ARGS=--upgrade, all packages get their newest versions; otherwise versions change only if pyproject.toml
# requires it.
lock: $(VENV)/.dev
	$(LOCK) pyproject.toml --output-file requirements.lock
	$(LOCK) pyproject.toml --group dev --constraints requirements.lock --output-file requirements-dev.lock
	$(LOCK) pyproject.toml --extra ros2 --constraints requirements-dev.lock \
		--output-file requirements-ros2.lock
	$(LOCK) pyproject.toml --group benchmarks --constraints requirements-dev.lock \
		--output-file requirements-benchmarks.lock
	$(LOCK) pyproject.toml --extra cluster --constraints requirements-dev.lock \
		--output-file requirements-cluster.lock
	$(LOCK) --group compiler --output-file requirements-compiler.lock
	$(LOCK) --group node --output-file requirements-node.lock
	$(LOCK) --group docs --output-file requirements-docs.lock

clean:
	rm -rf $(VENV) $(NATIVE) $(STUDIO) $(HELP) app/studio/node_modules app/studio/.node build dist .mypy_cache .ruff_cache .pytest_cache .import_linter_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
