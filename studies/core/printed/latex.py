"""Tables in LaTeX, for booktabs: every text as it is, units upright.

>>> escaped("50 % of a_b")
'50 \\\\% of a\\\\_b'
>>> unit("m2 s")
'$\\\\mathrm{m}^{2}\\\\,\\\\mathrm{s}$'
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from unicodedata import name as called
from unicodedata import normalize

from studies.core.text import one_line

LONG = 40  # lines: more go over several pages
WIDEST, GAP = 110, 3  # characters: of a table in 8 points on 174 mm, and between columns
SPECIAL = {
    **{character: f"\\{character}" for character in "%_&#${}"},
    **{"~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\\": r"\textbackslash{}"},
    **{"<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}", '"': r"\char34{}"},
    **{"µ": r"\textmu{}", "μ": r"\textmu{}", "²": r"\textsuperscript{2}", "·": r"$\cdot$"},
    **{"±": r"$\pm$", "\u00d7": r"$\times$", "\u2212": "$-$", "°": r"\textdegree{}"},
    **{"≤": r"$\leq$", "≥": r"$\geq$", "≈": r"$\approx$", "∞": r"$\infty$", "→": r"$\to$"},
    **{"Ω": r"$\Omega$", "Δ": r"$\Delta$", "Σ": r"$\Sigma$", "∂": r"$\partial$", "√": r"$\surd$"},
    **{each: f"$\\{called(each).split()[-1].lower()}$" for each in "αβγδζηθκνξπρστφχψω"},
    "λ": r"$\lambda$",
}
KNOWN = "\u2013\u2014\u2018\u2019“”…†‡•©®™€£§ßæøœłÆØŒŁ"  # beside ASCII's letters with accents
NUMBER = re.compile(r"(?<![\w.])([+-]?)(\d+(?:\.\d+)?)(?:e([+-]?\d+))?(?![\w.])")
UNITS = "1 % m mm µm um s ms µs us Hz rad deg N kg g dB J Pa"
FACTOR = re.compile(rf"({'|'.join(UNITS.split())})(?:\^?(-?\d+))?")


def escaped(text: object) -> str:
    """Return a text on one line as LaTeX prints it, nothing in it an order."""
    return _escaped(one_line(text))


def _escaped(line: str) -> str:
    return "".join(SPECIAL.get(character, character) for character in line)


def number(text: object) -> str:
    """Return a cell of numbers as `escaped`, with a minus that is one, and powers of ten.

    >>> number("-5.9e-07 [-0.1, 2]")
    '$-5.9\\\\cdot10^{-7}$ [$-0.1$, 2]'
    """
    line, done = one_line(text), 0
    parts = []
    for found in NUMBER.finditer(line):
        sign, digits, power = found.groups()
        factor = rf"\cdot10^{{{int(power)}}}" if power else ""
        plain = not factor and sign != "-"
        parts.append(_escaped(line[done : found.start()]))
        parts.append(sign + digits if plain else f"${sign}{digits}{factor}$")
        done = found.end()
    return "".join([*parts, _escaped(line[done:])])


def strange(text: str) -> str:
    """Return the letters of a text, each once, for which pdfLaTeX has no type."""
    own = {each for each in text if not each.isascii() and each not in KNOWN}
    return "".join(sorted(each for each in own if not normalize("NFD", each)[0].isascii()))


def unit(text: str) -> str:
    """Return a unit in roman letters, its digits as powers; what is no such unit, as a text."""
    parts = [part.split() for part in text.replace("²", "2").split("/")]
    matches = [[FACTOR.fullmatch(each) for each in part] for part in parts]
    if not text or len(parts) > 2 or not all(part and all(part) for part in matches):
        return escaped(text)
    between = r"\,"
    sides = (between.join(_factor(*each.groups()) for each in side if each) for side in matches)
    return f"${'/'.join(sides)}$"


def _factor(name: str, power: str | None) -> str:
    letters = name.replace("µ", r"\mbox{\textmu}").replace("%", r"\%")
    base = name if name == "1" else rf"\mathrm{{{letters}}}"
    return base + (f"^{{{power}}}" if power else "")


def tabular(
    headings: Sequence[tuple[str, str]],
    right: Sequence[bool],
    lines: Sequence[Sequence[str]],
    title: str = "",
    note: str = "",
) -> str:
    """Return a table as a float, or over pages if it is long; needs booktabs, and then longtable.

    What is wider than a page is several tables, each with the first column.

    Args:
        headings: of the columns, each with its unit or without. right: which are numbers.
        lines: of cells, as many as there are columns; one with none is a gap.
        title, note: the caption; nothing for neither.
    """
    parts = _parts(headings, lines)
    written = []
    for i, chosen in enumerate(parts):
        said = f"{one_line(title).rstrip(':.')} (part {i + 1} of {len(parts)})"
        shown = [[line[k] for k in chosen] if line else [] for line in lines]
        of = ([headings[k] for k in chosen], [right[k] for k in chosen], shown)
        written.append(_tabular(*of, said.strip() if len(parts) > 1 else title, note))
    return "\n".join(written)


def _parts(headings: Sequence[tuple[str, str]], lines: Sequence[Sequence[str]]) -> list[list[int]]:
    """Return which columns stand beside each other, so that a page is wide enough."""
    full = [line for line in lines if line]
    widths = [
        GAP + max([len(name) + len(u) + 3 * bool(u), *(len(line[k]) for line in full)])
        for k, (name, u) in enumerate(headings)
    ]
    parts, used = [[0]], widths[0]
    for k in range(1, len(headings)):
        if used + widths[k] > WIDEST and len(parts[-1]) > 1:
            parts.append([0])
            used = widths[0]
        parts[-1].append(k)
        used += widths[k]
    return parts


def _tabular(
    headings: Sequence[tuple[str, str]],
    right: Sequence[bool],
    lines: Sequence[Sequence[str]],
    title: str,
    note: str,
) -> str:
    """Return a table that is narrow enough."""
    columns = "".join("r" if each else "l" for each in right)
    head = " & ".join(escaped(name) + (f" [{unit(u)}]" if u else "") for name, u in headings)
    body = [_line(line, right) for line in lines]
    words = [one_line(each).rstrip(":.") for each in (title, note) if one_line(each)]
    caption = " ".join(f"{escaped(each)}." for each in words)
    caption = rf"\caption{{{caption}}}" if caption else ""
    end = r" \\"
    if len(body) > LONG:
        packages, first = "booktabs and longtable", rf"\begin{{longtable}}{{{columns}}}"
        above = [first, *([caption + end] if caption else []), r"\toprule", head + end, r"\midrule"]
        above.append(r"\endhead")
        below = [r"\bottomrule", r"\end{longtable}"]
    else:
        packages = "booktabs"
        opening = [r"\begin{table}", r"\centering", *([caption] if caption else [])]
        above = [*opening, rf"\begin{{tabular}}{{{columns}}}", r"\toprule", head + end, r"\midrule"]
        below = [r"\bottomrule", r"\end{tabular}", r"\end{table}"]
    text = "\n".join([*above, *body, *below]) + "\n"
    letters = strange(text)
    needed = f"; LuaLaTeX or XeLaTeX, and a type that has {letters}" if letters else ""
    return f"% needs the packages {packages}{needed}\n{text}"


def _line(cells: Sequence[str], right: Sequence[bool]) -> str:
    if not cells:
        return r"\addlinespace"
    shown = [
        number(cell) if each else escaped(cell) for cell, each in zip(cells, right, strict=True)
    ]
    guard = "{}" if shown[0].startswith(("[", "*")) else ""  # no argument of the line before
    return guard + " & ".join(shown) + r" \\"
