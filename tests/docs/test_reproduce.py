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
import comparing  # noqa: E402
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
LINK = re.compile(r"\]\(([^)#:]+)[^)]*\)")
MATHS = re.compile(r"\$[^$]*\$")
YEAR = re.compile(r"(19|20)\d\d")
BLOCK = ["line   5.3 [5.1, 5.5]   17 of 20", "circle   14.5 [14.2, 14.7]   20 of 20"]


def of(printed: list[str], **item: Any) -> reproduce.Found:
    return reproduce.compared(BLOCK, printed, item)


@pytest.mark.parametrize("name", ITEMS)
def test_every_item_has_its_place_and_a_cost(name: str) -> None:
    item = ITEMS[name]
    asked = [reproduce.asked_by(each) for each in ITEMS.values()]
    first = list(ITEMS)[asked.index(reproduce.asked_by(item))] == name
    assert (item["minutes"] > 0) if first else "minutes" not in item
    assert item["command"].startswith(("flexsim ", "python docs/made/"))
    assert item.get("prose", ["?"]) and item.get("said", ["?"])
    for words in reproduce.words_of(item):
        assert words in reproduce.text_of(item["document"])
        assert reproduce.NUMBER.search(words)
    if "said" not in item and "prose" not in item:
        assert len(reproduce.block_of(item)) > 1


def remade(document: str, skipped: bool = False) -> set[str]:
    """Return the lines of a document that an item makes again and compares, or does not."""
    mine = [item for item in ITEMS.values() if item["document"] == document and "begins" in item]
    return {
        line
        for item in mine
        for line in reproduce.block_of(item)
        if skipped or not any(part in line for part in item.get("skip", []))
    }


def given(document: str, what: str) -> list[str]:
    return [each for item in GIVEN if item["document"] == document for each in item.get(what, [])]


def counted(lines: list[str]) -> int:
    return sum(len(reproduce.NUMBER.findall(line)) for line in lines)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_block_of_numbers_has_a_source(document: str) -> None:
    """Of an item, or one of those that cannot be made again, for a reason."""
    known, exempt = remade(document, skipped=True), given(document, "blocks")
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


def linked(document: str, paragraph: str) -> list[str]:
    """Return the documents that a paragraph links to."""
    here = (ROOT / document).parent
    targets = [(here / each).resolve() for each in LINK.findall(paragraph)]
    pages = [each / "README.md" if each.is_dir() else each for each in targets]
    return [each for each in DOCUMENTS if ROOT / each in pages]


@pytest.mark.parametrize("document", DOCUMENTS)
def test_every_number_in_the_text_has_a_source(document: str) -> None:
    """In a block of this document, or of one that the paragraph links to; or said, or exempt."""
    blocks = {each: reproduce.NUMBER.findall(" ".join(remade(each))) for each in DOCUMENTS}
    mine = [item for item in ITEMS.values() if item["document"] == document]
    said = [words for item in mine for words in reproduce.words_of(item)]
    known = {*blocks[document], *reproduce.NUMBER.findall(" ".join(said))}
    known |= {number for item in mine for number in item.get("prose", [])}
    known |= set(given(document, "numbers"))
    for paragraph in reproduce.paragraphs(document):
        quoted = known.union(*(blocks[each] for each in linked(document, paragraph)))
        own = {comparing.value(each) for each in quoted}
        unknown = [
            number
            for number in reproduce.NUMBER.findall(MATHS.sub("", reproduce.plain(paragraph)))
            if len(significant(number)) >= DIGITS
            and not YEAR.fullmatch(number)
            and comparing.value(number) not in own
        ]
        assert not unknown, paragraph


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


@pytest.mark.parametrize("now", ["diverged", "nan [nan, nan]", "inf", "-"])
def test_a_number_that_is_none_any_more_has_left(now: str) -> None:
    found = of([f"line   {now}   17 of 20", BLOCK[1]])
    assert not found.holds and "5.3" in (found.left + found.missing)[0]


def test_a_number_without_interval_that_is_none_any_more_has_moved() -> None:
    found = reproduce.compared(["line 5.3 17"], ["line diverged 17"], {})
    assert found.holds and found.moved == ["line 5.3 17 -> line diverged 17"]


def test_a_number_too_many_and_other_words_have_moved() -> None:
    found = reproduce.compared(["line 5.3 17"], ["line 5.3 999 17"], {})
    assert (found.same, found.moved) == (2, ["line 5.3 17 -> line 5.3 999 17"])
    found = reproduce.compared(["all 5 loops hold"], ["all 5 loops fail"], {})
    assert (found.same, found.moved) == (1, ["all 5 loops hold -> all 5 loops fail"])


def test_rows_of_one_shape_are_told_apart_by_their_order() -> None:
    block = ["ideal", "line 5.4 [5.3, 5.5]", "jump", "line 7.4 [7.3, 7.5]", "end"]
    assert reproduce.compared(block, block, {}).same == 6
    exchanged = [block[0], block[3], block[2], block[1], block[4]]
    assert len(reproduce.compared(block, exchanged, {}).left) == 2
    for gone in (1, 3):
        found = reproduce.compared(block, block[:gone] + block[gone + 1 :], {})
        assert found.missing == [block[gone]] and found.same == 3
    assert reproduce.compared(block, ["title", *block, *block[:2]], {}).same == 6


def test_intervals_of_any_form_are_read() -> None:
    def left(line: str, now: str) -> bool:
        return bool(reproduce.compared(line.split("\n"), now.split("\n"), {}).left)

    assert left("a 2.5 [1.0, ?]", "a 0.9 [1.0, ?]") and not left("a 2.5 [1.0, ?]", "a 9 [1.0, ?]")
    wrapped = "a 3.35 [3.31,  0.5 [0.4,  10\n       3.42]      0.6],"
    assert not left(wrapped, wrapped.replace("3.35", "3.40"))
    assert left(wrapped, wrapped.replace("3.35", "3.43"))
    assert left(wrapped, wrapped.replace("0.5 [", "0.61 ["))
    assert left("a −0.5 [−0.6, −0.4]", "a 0.5 [−0.6, −0.4]")


def test_what_is_a_number() -> None:
    text = "chain:6 at 1,234.5, -2e-3, x1.1, −0.5 and 7."
    assert reproduce.NUMBER.findall(text) == ["1,234.5", "-2e-3", "1.1", "−0.5", "7"]
    assert reproduce.NUMBER.findall("12.5mm, 1.2.3, chain6, 5us") == []  # so words, which may move


def test_a_line_that_is_gone_is_named_unless_it_is_the_machines() -> None:
    assert of([BLOCK[0]]).missing == [BLOCK[1]]
    assert of([BLOCK[0]], skip=["circle"]).holds


def test_lines_are_found_in_any_surroundings() -> None:
    found = of(["line   9.9 [9.8, 9.9]   1 of 2", *BLOCK, "circle   1 [0, 2]   3 of 4"])
    assert (found.same, found.holds) == (10, True)


def test_what_is_the_machines_is_not_compared() -> None:
    assert of(["line   5.3 [5.1, 5.5]   18 of 20", BLOCK[1]], machine=[r"\d+ of 20"]).moved == []


def test_a_number_in_a_name_is_a_part_of_it() -> None:
    block = ["untuned:5   1   17", "untuned:6   1   17"]
    found = reproduce.compared(block[1:], block, {})
    assert (found.same, found.moved) == (2, [])


def test_a_line_that_the_document_wraps_is_one() -> None:
    printed = [
        "before",
        "7 of 8 hold in the one, and " + "so on and on " * 6 + "to 3 in all.",
        "after",
    ]
    block = [printed[1][:40], printed[1][40:].strip()]
    assert reproduce.compared(block, printed, {}).same == 3
    other = [printed[0], printed[1].replace("to 3", "to 4"), printed[2]]
    assert len(reproduce.compared(block, other, {}).moved) == 1


def test_what_is_said_is_printed_with_its_interval() -> None:
    words = ["5.3 [5.1, 5.5] mm, 17 of 20"]
    assert reproduce.in_words(words, BLOCK).same == 5
    other = [BLOCK[0].replace("5.1", "5.0"), "5.1 5.5"]  # each number is there, not together
    assert reproduce.in_words(words, other).missing[0].startswith("5.3 [5.1, 5.5] is not printed")
    assert len(reproduce.in_words(words, [""]).missing) == 3


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A document and items of a test's own."""
    (tmp_path / "page.md").write_text(PAGE, encoding="utf-8")
    (tmp_path / "published.toml").write_text(OWN, encoding="utf-8")
    monkeypatch.setattr(reproduce, "ROOT", tmp_path)
    monkeypatch.setattr(reproduce, "PUBLISHED", tmp_path / "published.toml")
    return tmp_path


PAGE = """# A page

It took **12** steps of [0.25](there.md) m, said
`three`, and ended at 7.5 m.

  | name | number |
  |---|---|
  | one | 1.5 |
"""
OWN = """
[table]
document = "page.md"
begins = "| one |"
before = ["echo '| one | 1.5 |' > file"]
command = "cat file"
out = ""
minutes = 1

[words]
document = "page.md"
said = ["12 steps of 0.25 m", "at 7.5 m"]
command = "echo 12 0.25 7.50"
out = ""
minutes = 1
quick = true

[sentence]
document = "page.md"
prose = ["0.25", "7.5"]
command = "echo 'It took 12 steps of 0.25 m, said three'; echo 'ended at 7.6 m'"
out = ""
minutes = 1

[derived]
document = "page.md"
said = "7.5"
of = "table"
command = "cat file; echo 7.5"
out = ""
minutes = 1

[broken]
document = "page.md"
said = "7.5"
command = "echo no such thing >&2; false"
out = ""
minutes = 1

[[not-remade]]
document = "page.md"
why = "an example"
"""


def test_tables_words_sentences_and_what_is_derived(
    own: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reproduce.main(["table", "words", "derived", "--out", str(own / "runs")]) == 0
    table = capsys.readouterr().out.split("\n")[-4:-1]
    assert [row.split()[0] for row in table] == ["table", "words", "derived"]
    assert [row.split()[2] for row in table] == ["1", "3", "1"]
    assert (own / "runs" / "table" / "printed-derived.txt").is_file()


def test_a_sentence_that_moved_is_named(own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert reproduce.main(["sentence", "--out", str(own / "runs")]) == 0
    assert "sentence moved: 7.5 -> 7.6 in: ended at 7.5 m" in capsys.readouterr().out


def test_what_fails_is_said_and_the_rest_goes_on(
    own: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reproduce.main(["broken", "derived", "sentence", "--out", str(own / "runs")]) == 1
    said = capsys.readouterr().out
    assert "broken failed: " in said and "no such thing" in said
    rows = [row.split() for row in said.split("\n")[-4:-1]]
    assert [row[0] for row in rows] == ["sentence", "derived", "broken"]  # as they are listed
    assert rows[-1][-2:] == ["failed", "page.md"] and rows[1][-2:] == ["0", "page.md"]


@pytest.mark.parametrize("name", ["words", "sentence", "table"])
def test_a_command_that_prints_nothing_does_not_hold(own: Path, name: str) -> None:
    assert not reproduce.found_of(reproduce.items()[name], [""]).holds


def test_an_item_without_a_number_does_not_hold(
    own: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = OWN.replace('prose = ["0.25", "7.5"]', "prose = []").replace("echo 'It", "true 'It")
    (own / "published.toml").write_text(text.replace("; echo 'ended", "; true 'ended"))
    assert reproduce.main(["sentence", "--out", str(own / "runs")]) == 1
    assert "sentence missing: no number was compared" in capsys.readouterr().out


def test_what_was_printed_is_kept_and_resumed(own: Path) -> None:
    out = str(own / "runs")
    assert reproduce.main(["table", "--out", out]) == 0
    kept = own / "runs" / "table" / "printed.txt"
    kept.write_text(kept.read_text().replace("1.5", "2.5"), encoding="utf-8")
    item = reproduce.items()["table"]
    assert reproduce.printed_by(item, kept.parent, True)[0][0] == "| one | 2.5 |"
    assert reproduce.printed_by(item, kept.parent, False)[0][0] == "| one | 1.5 |"
    kept.write_text(kept.read_text().replace("1.5", "2.5"), encoding="utf-8")
    (own / "docs" / "made").mkdir(parents=True)
    (own / "docs" / "made" / "one.py").write_text("")  # another source
    assert reproduce.printed_by(item, kept.parent, True)[0][0] == "| one | 1.5 |"


def test_a_file_that_is_read_before_is_a_source(own: Path) -> None:
    item = {"before": ["cat {root}/page.md"], "command": "true"}
    before = reproduce._made_of(item)
    (own / "page.md").write_text("other")
    assert reproduce._made_of(item) != before
    assert reproduce._made_of({**item, "before": ["cp {root}/page.md x"]}) != before


def test_a_root_with_a_space_is_one_word(
    own: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    root = tmp_path / "a b"
    root.mkdir()
    (root / "page.md").write_text("7")
    monkeypatch.setattr(reproduce, "ROOT", root)
    item = {"before": ["cp {root}/page.md ."], "command": "cat page.md {root}/page.md", "out": ""}
    assert reproduce.printed_by(item, tmp_path / "c d", False)[0] == ["77"]


def test_what_cannot_be_is_said_in_a_line(own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (own / "file").write_text("")
    assert reproduce.main(["table", "--out", str(own / "file")]) == 1
    assert "table failed: [Errno 20] Not a directory" in capsys.readouterr().out
    for wrong in (["nonsense"], ["--quick", "table"]):
        with pytest.raises(SystemExit):
            reproduce.main(wrong)


def test_an_interrupted_run_shows_what_was_done(
    own: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    ran = reproduce.printed_by

    def interrupted(item: Any, *how: Any) -> Any:
        if "12 0.25" in item["command"]:
            raise KeyboardInterrupt
        return ran(item, *how)

    monkeypatch.setattr(reproduce, "printed_by", interrupted)
    assert reproduce.main(["table", "words", "--out", str(own / "runs")]) == 130
    assert capsys.readouterr().out.rstrip().split("\n")[-1].startswith("table ")


def test_the_quick_subset_is_as_published(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status = reproduce.main(["--quick", "--out", str(tmp_path)])
    said = capsys.readouterr().out
    assert status == 0, said
    assert sum(item.get("quick", False) for item in ITEMS.values()) >= 3
    assert "moved:" not in said, said
