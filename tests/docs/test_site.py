"""The site: built without a broken link, formulas tied to code, examples and notebooks that run."""

from __future__ import annotations

import doctest
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
THEORY = sorted((DOCS / "theory").glob("*.md"))
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
FORMULA = re.compile(r"^\$\$.*?\$\$$", re.S | re.M)
TIED = re.compile(r"\n\nCode: \[`[\w.]+`\]\(\.\./\.\./[\w/]+\.py\)")
FLAGS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS


def built(root: Path, to: Path) -> subprocess.CompletedProcess[str]:
    """Build the site as `make docs` does."""
    makefile = (root / "Makefile").read_text(encoding="utf-8")
    (recipe,) = re.findall(r"^docs: install\n\t(.*)$", makefile, re.M)
    command = recipe.replace("$(BIN)/mkdocs", f"{shlex.quote(sys.executable)} -m mkdocs")
    command = command.replace("--site-dir site", f"--site-dir {shlex.quote(str(to))}")
    return subprocess.run(command, shell=True, capture_output=True, text=True, cwd=root)


def test_the_site_is_built_without_a_broken_link(tmp_path: Path) -> None:
    """Pages, READMEs, anchors, and the place in the reference of every function that is named."""
    done = built(ROOT, tmp_path / "site")
    assert done.returncode == 0 and "WARNING" not in done.stderr, done.stderr
    page = (tmp_path / "site" / "theory" / "arm.html").read_text(encoding="utf-8")
    assert page.count("<math") > 10 and "arithmatex" not in page
    wanted = "reference/flexsim/plants/assumed_modes.html#flexsim.plants.assumed_modes.mass_matrix"
    assert wanted in page
    assert (tmp_path / "site" / "repository" / "studies" / "compare" / "index.html").is_file()
    assert not re.findall(r'(?:src|href)="(?:https?:)?//[^"]*"', _loaded(page))


def _loaded(page: str) -> str:
    """Return the tags by which a page loads something: nothing from elsewhere, to open offline."""
    return " ".join(re.findall(r"<(?:script|link|img)[^>]*>", page))


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("[x](nowhere.md)", "nowhere.md"),
        ("[x](limits.md#nothing)", "no such anchor"),
        ("[`no_such`](../flexsim/arm/beam.py)", "flexsim.arm.beam.no_such"),
    ],
)
@pytest.mark.slow
def test_a_broken_link_is_found(line: str, said: str, tmp_path: Path) -> None:
    copy = tmp_path / "copy"
    left_out = shutil.ignore_patterns(".venv", ".git", "site", "runs", "__pycache__", ".*_cache")
    shutil.copytree(ROOT, copy, ignore=left_out)
    with (copy / "docs" / "limits.md").open("a", encoding="utf-8") as limits:
        limits.write(f"\n{line}\n")
    done = built(copy, tmp_path / "site")
    assert done.returncode != 0 and said in done.stderr


@pytest.mark.parametrize("page", THEORY, ids=lambda page: page.stem)
def test_every_formula_is_tied_to_code(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    formulas = list(FORMULA.finditer(text))
    assert formulas
    for formula in formulas:
        assert TIED.match(text, formula.end()), f"no code behind: {formula.group()}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_examples_of_the_pages_run(page: Path) -> None:
    failed, _ = doctest.testfile(str(page), module_relative=False, optionflags=FLAGS)
    assert failed == 0


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebooks_run_and_say_what_they_said(path: Path) -> None:
    """Text that they print is the same; pictures are there."""
    notebook = nbformat.read(path, as_version=4)
    before = [_said(cell) for cell in notebook.cells]
    resources = {"metadata": {"path": str(path.parent)}}
    NotebookClient(notebook, timeout=600, resources=resources).execute()
    assert [_said(cell) for cell in notebook.cells] == before
    assert any(before), "a notebook that says nothing"


def _said(cell: nbformat.NotebookNode) -> tuple[str, int]:
    """Return what a cell printed, and how many pictures it drew."""
    outputs = cell.get("outputs", [])
    text = "".join(each.get("text", "") for each in outputs)
    return text, sum("image/png" in each.get("data", {}) for each in outputs)


def test_there_are_three_notebooks() -> None:
    assert len(NOTEBOOKS) == 3
