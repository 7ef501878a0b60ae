"""What the documents quote: blocks that are there, the quick subset made again, what is said."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))
import reproduce  # noqa: E402

ITEMS = reproduce.items()
GIVEN = tomllib.loads(reproduce.PUBLISHED.read_text(encoding="utf-8"))[reproduce.GIVEN]
DOCUMENTS = sorted(
    str(path.relative_to(ROOT))
    for pattern in ("README.md", "models/README.md", "controllers/README.md")
    for path in ROOT.glob(pattern)
) + sorted(
    str(path.relative_to(ROOT))
    for folder, pattern in (("studies", "README.md"), ("docs", "*.md"))
    for path in (ROOT / folder).rglob(pattern)
)
FEW = 4  # numbers in a block that need no source
DIGITS = 3  # of numbers in the text that need one
MATHS = re.compile(r"\$[^$]*\$")
YEAR = re.compile(r"(19|20)\d\d")
BLOCK = ["line   5.3 [5.1, 5.5]   17 of 20", "circle   14.5 [14.2, 14.7]   20 of 20"]


def of(printed: list[str], **item: Any) -> reproduce.Found:
    return reproduce.compared(BLOCK, printed, item)


@pytest.mark.parametrize("name", ITEMS)
def test_every_item_has_its_place_and_a_cost(name: str) -> None:
    item = ITEMS[name]
    assert item["minutes"] > 0 and item["command"].startswith(("flexsim ", "python docs/made/"))
    for words in reproduce.words_of(item):
        assert words in reproduce.text_of(item["document"])
        assert reproduce.NUMBER.search(words)
    if "said" not in item and "prose" not in item:
        assert len(reproduce.block_of(item)) > 1


def remade(document: str) -> set[str]:
    """Return the lines of a document that an item makes again."""
    mine = [item for item in ITEMS.values() if item["document"] == document and "begins" in item]
    return {line for item in mine for line in reproduce.block_of(item)}


def given(document: str, what: str) -> list[str]:
    return [each for item in GIVEN if item["document"] == document for each in item.get(what, [])]


def counted(lines: list[str]) -> int:
    return sum(len(reproduce.NUMBER.findall(line)) for line in lines)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_block_of_numbers_has_a_source(document: str) -> None:
    """Of an item, or one of those that cannot be made again, for a reason."""
    known, exempt = remade(document), given(document, "blocks")
    for block in reproduce.blocks(document):
        of_none = [line for line in block if line.strip() and line not in known]
        title = block[0].startswith("|") and len(of_none) < len(block) and of_none == block[:2]
        if title or counted(block) < FEW or not counted(of_none):
            continue
        named = any(begins in line for begins in exempt for line in block)
        commands = all(line.startswith("flexsim ") for line in of_none if counted([line]))
        assert named or commands, of_none[:3]


def significant(number: str) -> str:
    return re.sub(r"\D", "", number.partition("e")[0]).lstrip("0")


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_number_in_the_text_has_a_source(document: str) -> None:
    """It stands in a block that is made again, in a sentence that is, or is said where it is of."""
    lines = {line for each in DOCUMENTS for line in remade(each)}
    blocks = {number for line in lines for number in reproduce.NUMBER.findall(line)}
    mine = [item for item in ITEMS.values() if item["document"] == document]
    said = [words for item in mine for words in reproduce.words_of(item)]
    known = blocks | {number for each in said for number in reproduce.NUMBER.findall(each)}
    known |= {number for item in mine for number in item.get("prose", [])}
    text = MATHS.sub("", reproduce.text_of(document))
    unknown = [
        number
        for number in reproduce.NUMBER.findall(text)
        if len(significant(number)) >= DIGITS
        and not YEAR.fullmatch(number)
        and number not in known
        and number not in given(document, "numbers")
    ]
    assert not unknown


def test_what_cannot_be_made_again_is_there_and_has_a_reason() -> None:
    """An entry that is not needed any more is named."""
    for item in GIVEN:
        assert len(item["why"]) > 5
        lines = [line for block in reproduce.blocks(item["document"]) for line in block]
        for begins in item.get("blocks", []):
            assert any(begins in line for line in lines), begins
        numbers = set(reproduce.NUMBER.findall(reproduce.text_of(item["document"])))
        assert set(item.get("numbers", [])) <= numbers, set(item["numbers"]) - numbers


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
