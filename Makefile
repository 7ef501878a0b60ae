# The two commands of the README, and what the checks run. Needs Python 3.11 or later and make.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUN ?= runs/compare

.PHONY: compare test slow check docs reproduce reproduce-quick format install clean

compare: install
	$(BIN)/flexsim compare --out $(RUN) --force

# The default suite; then design, model files, closed loop and compare under another BLAS kernel, and
# the digits of two kernels against each other
test: install
	$(BIN)/python -m pytest -q -n 2 --dist loadfile --no-loadscope-reorder
	$(BIN)/python tests/kernels.py -q -n 2 --dist loadfile -m "(kernels or digits) and not slow"

slow: install
	$(BIN)/python -m pytest -q -m "slow or not slow"

check: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The site, into site/: it opens from there, offline; broken links end it
docs: install
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --site-dir site

# Every block that the documents quote, made again and compared; ITEMS="compare ladder" for some of them
reproduce: install
	$(BIN)/python docs/reproduce.py $(ITEMS)

reproduce-quick: install
	$(BIN)/python docs/reproduce.py --quick

format: install
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

install: $(VENV)/installed

$(VENV)/installed: pyproject.toml constraints.txt tests/crates.txt
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check -c constraints.txt -e '.[dev]'
	$(PYTHON) -m venv $(VENV)/crates
	$(VENV)/crates/bin/python -m pip install --quiet --no-compile --disable-pip-version-check -r tests/crates.txt
	touch $@

clean:
	rm -rf $(VENV)
