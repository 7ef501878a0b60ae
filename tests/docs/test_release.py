"""A release: one version everywhere, a changelog for it, a tag that is it."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from cffconvert import Citation
from programs import missing

ROOT = Path(__file__).parents[2]
SECTION = re.compile(r"^## (.*)$", re.M)
RELEASED = re.compile(r"(\d+\.\d+\.\d+) \((\d{4}-\d{2}-\d{2})\)")


def text(name: str) -> str:
    return (ROOT / name).read_text(encoding="utf-8")


def version() -> str:
    (found,) = re.findall(r'^version = "(.*)"$', text("pyproject.toml"), re.M)
    return str(found)


def sections() -> list[str]:
    return SECTION.findall(text("CHANGELOG.md"))


def test_the_citation_is_valid_and_of_this_version() -> None:
    citation = text("CITATION.cff")
    Citation(citation).validate()
    newest, date = next(m.groups() for m in map(RELEASED.fullmatch, sections()) if m)
    assert newest == version()
    assert f"version: {newest}\n" in citation and f"date-released: {date}\n" in citation


def test_every_section_of_the_changelog_is_a_version_the_newest_first() -> None:
    found = sections()
    released = found[1:] if found[0] == "Unreleased" else found
    matches = [RELEASED.fullmatch(each) for each in released]
    assert all(matches), released
    numbers = [tuple(map(int, m[1].split("."))) for m in matches if m]
    dates = [m[2] for m in matches if m]
    assert numbers == sorted(numbers, reverse=True) and len(set(numbers)) == len(numbers)
    assert dates == sorted(dates, reverse=True)


def test_a_tag_of_this_commit_is_the_version() -> None:
    if not (ROOT / ".git").exists():
        missing("this is no checkout")
    done = subprocess.run(
        ["git", "tag", "--points-at", "HEAD"], capture_output=True, text=True, cwd=ROOT, check=True
    )
    tags = [tag for tag in done.stdout.split() if tag.startswith("v")]
    assert all(tag == f"v{version()}" for tag in tags)


def test_the_guide_names_this_version() -> None:
    assert f"git tag -a v{version()} " in text("docs/CONTRIBUTING.md")
