# The two commands of the README, and what the checks run. Needs Python 3.11 or later and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUN ?= runs/compare

.PHONY: compare test slow check format install clean

compare: install
	$(BIN)/flexsim compare --out $(RUN) --force

# The default suite; then design, model files, closed loop and compare under another BLAS kernel, and
# the digits of two kernels against each other
test: install
	$(BIN)/python -m pytest -q -n 2 --dist loadfile
	$(BIN)/python tests/kernels.py -q -n 2 --dist loadfile -m "(kernels or digits) and not slow"

slow: install
	$(BIN)/python -m pytest -q -m "slow or not slow"

check: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: install
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

install: $(VENV)/installed

$(VENV)/installed: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e '.[dev]'
	touch $@

clean:
	rm -rf $(VENV)
