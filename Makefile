# make demo   build .venv, run the paper's room end to end, write the report
# make test   build .venv, run the tests
# make slow   run the proofs that take many seconds each
# make check  linter and type checker
# make docs   build the site of the documentation under site/
# make newest run the tests with the newest allowed version of every dependency, in .venv-newest
# make interop  have deepmimo, evo and rerun read our files, in .venv-interop
# make lock   resolve the dependencies anew
# make clean  remove .venv and caches (results under runs/ stay)

VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps

.PHONY: demo test slow check docs newest interop lock clean
.DELETE_ON_ERROR:

demo: $(READY)
	@$(BIN)/rislam-rt run pipelines/demo.toml

# Two processes test at a time: threads of the linear algebra would fight over the same two cores, and take twice the time.
test slow newest interop: export OPENBLAS_NUM_THREADS = 1
test slow newest interop: export OMP_NUM_THREADS = 1
test slow newest interop: export MKL_NUM_THREADS = 1
# The tests start Python a hundred times: bytecode is kept, whatever the shell says.
demo test slow docs newest interop: export PYTHONDONTWRITEBYTECODE =

test: $(READY)
	@$(BIN)/python -m pytest -n 2 --dist worksteal

slow: $(READY)
	@$(BIN)/python -m pytest -n 2 -m slow

check: $(READY)
	@$(BIN)/ruff format --check . && $(BIN)/ruff check . && $(BIN)/mypy

docs: $(READY)
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet && echo "site/index.html"

# Everything is pinned with hashes, the build back end too, so that no step resolves anything by itself: pip need not ask
# what depends on what (3 s of 45).
# Two modules of three are never used: compiled are those that are, when they are first. Two processes install half of
# the packages each, once pip itself is what it will stay, which the one that Python brings installs from where it lies,
# where that is known (2 s); mkdocs-material and sionna-rt, with 10 000 files each, are in
# different halves.
$(READY): requirements.lock pyproject.toml
	@python=''; \
	for candidate in $(PYTHON) python3 python3.13 python3.12 python3.11 python; do \
	  if $$candidate -c 'import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))' \
	    >/dev/null 2>&1; then python=$$candidate; break; fi; \
	done; \
	if [ -z "$$python" ]; then \
	  echo 'error: no Python 3.11, 3.12 or 3.13 with its venv module found; install one, or name it: make PYTHON=/path/to/python3.12' >&2; \
	  exit 3; \
	fi; \
	echo "building $(VENV) with $$($$python --version)"; \
	$$python -m venv --without-pip $(VENV)
	@awk -v to=$(VENV)/lock. '/^[^ #]/ {turn = 1 - turn; part = /^pip==/ ? "pip" : /^mkdocs-material==/ ? 1 : /^sionna-rt==/ ? 0 : turn} {print > (to part)}' requirements.lock
	@wheel=$$($(BIN)/python -c 'import ensurepip, pathlib; \
	  print(*pathlib.Path(ensurepip.__file__).parent.glob("_bundled/pip-*.whl"))'); \
	if [ ! -f "$$wheel" ]; then $(BIN)/python -m ensurepip >/dev/null; wheel=; fi; \
	PYTHONPATH=$$wheel $(INSTALL) --no-compile --require-hashes -r $(VENV)/lock.pip
	@printf '0\n1\n' | xargs -P 2 -I N $(INSTALL) --no-compile --require-hashes -r $(VENV)/lock.N
	@$(INSTALL) --no-build-isolation -e .
	@touch $@

newest: $(READY)
	@$(BIN)/python -m venv .venv-newest
	@.venv-newest/bin/python -m pip install --quiet --disable-pip-version-check --upgrade --upgrade-strategy eager -e '.[dev]'
	@.venv-newest/bin/python -m pytest -n 2

# deepmimo asks for an older numpy than the lock file has, and rerun is 700 MB: neither is in .venv.
interop: $(READY)
	@$(BIN)/python -m venv .venv-interop
	@.venv-interop/bin/python -m pip install --quiet --disable-pip-version-check -e '.[interop]' pytest pytest-timeout
	@.venv-interop/bin/python -m pytest -m interop tests/report/exports/test_interop.py

lock:
	@uv pip compile --universal --generate-hashes --no-emit-index-url --no-header --python-version 3.11 --extra dev \
	  --quiet --output-file requirements.lock pyproject.toml
	@! grep -n '://' requirements.lock

clean:
	rm -rf $(VENV) .venv-newest .venv-interop build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
