"""What the documents quote: blocks that are there, the quick subset made again, what is said."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))
import reproduce  # noqa: E402

ITEMS = tomllib.loads(reproduce.PUBLISHED.read_text(encoding="utf-8"))
BLOCK = ["line   5.3 [5.1, 5.5]   17 of 20", "circle   14.5 [14.2, 14.7]   20 of 20"]


def of(printed: list[str], **item: Any) -> reproduce.Found:
    return reproduce.compared(BLOCK, printed, item)


@pytest.mark.parametrize("name", ITEMS)
def test_every_item_has_its_block_and_a_cost(name: str) -> None:
    assert len(reproduce.block_of(ITEMS[name])) > 3
    assert ITEMS[name]["minutes"] > 0 and ITEMS[name]["command"].startswith("flexsim ")


def test_the_list_is_in_the_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert reproduce.main(["--list"]) == 0
    text = (ROOT / "docs" / "reproduce.md").read_text(encoding="utf-8")
    assert f"```\n{capsys.readouterr().out}```" in text


def test_a_document_without_the_block_is_named() -> None:
    with pytest.raises(ValueError, match=r"README\.md has no block that begins with 'zzz'"):
        reproduce.block_of({"document": "README.md", "begins": "zzz"})


def test_numbers_are_the_same_inside_moved_or_left() -> None:
    found = of(["something else", *BLOCK])
    assert (found.same, found.inside, found.holds) == (10, 0, True)
    found = of(["line   5.4 [5.1, 5.5]   17 of 20", BLOCK[1]])
    assert (found.same, found.inside, found.moved, found.holds) == (9, 1, [], True)
    found = of(["line   5.6 [5.1, 5.5]   17 of 20", BLOCK[1]])
    assert not found.holds and found.left[0].startswith("5.3 -> 5.6 in: line")
    found = of(["line   5.3 [5.1, 5.5]   18 of 20", BLOCK[1]])
    assert found.holds and found.moved[0].startswith("17 -> 18")


def test_a_line_that_is_gone_is_named_unless_it_is_the_machines() -> None:
    assert of([BLOCK[0]]).missing == [BLOCK[1]]
    assert of([BLOCK[0]], skip=["circle"]).holds


def test_lines_are_found_in_any_surroundings() -> None:
    found = of(["line   9.9 [9.8, 9.9]   1 of 2", *BLOCK, "circle   1 [0, 2]   3 of 4"])
    assert (found.same, found.holds) == (10, True)


def test_the_quick_subset_is_as_published(capsys: pytest.CaptureFixture[str]) -> None:
    status = reproduce.main(["--quick"])
    said = capsys.readouterr().out
    assert status == 0, said
    assert sum(item.get("quick", False) for item in ITEMS.values()) >= 3
    assert "moved:" not in said, said
