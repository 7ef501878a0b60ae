"""What `flexsim converge` shows: its tables, its verdict, its facts."""

from __future__ import annotations

import textwrap
from typing import Any

from flexsim.recording.traces import MM
from studies.converge.judging import BEYOND, FLOOR, OPEN, WITHIN
from studies.converge.rows import Convergence, LadderRow
from studies.core.table import Column, Table

MS, UM = 1e3, 1e6
MARKS = {WITHIN: "within", BEYOND: "beyond", OPEN: "?"}
SHORT = {"line by two-loop": "transfer"}
WIDTH = 79  # characters


def tables(result: Convergence) -> list[Table]:
    """Return the rungs to read; rungs, their cases and the ladders as files."""
    cases = [
        Column("envelope_change", SHORT.get(name, name), "mm", "+.2f", MM, index=i)
        for i, name in enumerate(result.cases)
    ]
    columns = (
        Column("label", ""),
        Column("step", unit="ms", form="g", scale=MS),
        Column("cost", form=".2g"),
        *cases,
        Column("rms_error_change", "rms", "mm", "+.2f", MM),
        Column("max_v_change", "|v|", "mm", "+.2f", MM),
        Column("growth", unit="1/s", form="+.3f"),
        Column("status", "", form=lambda row: MARKS[row.status]),
    )
    note = (
        f"Medians of {result.runs} runs less those of {result.reference},\n"
        "of steps less those of the shortest: of envelopes; of rms errors and max |v|\n"
        "the largest of all cases. *: the default. Cost on one core over the exact\n"
        "beam's; growth of the linear loop as stepped, the largest of all cases.\n"
        "within: all changes lie, with their 95 % intervals, in those of published\n"
        f"medians, or in +-{MM * FLOOR:g} mm; beyond: one is outside, or the loop grows where\n"
        "the exact one does not, or the other way round; ?: the runs do not tell\n"
    )
    return [
        Table(
            result.rungs,
            columns,
            "Changes from the exact beam",
            note,
            "rungs",
            "rungs.csv",
            section=(Column("ladder"),),
            tight=True,
        ),
        Table(result.rows, key="rows", file="rows.csv"),
        Table(result.ladders, key="ladders", file="ladders.csv"),
    ]


def facts(result: Convergence) -> dict[str, Any]:
    """Return what all is held against, and what to know of it."""
    return {
        "cases": result.cases,
        "reference": {"name": result.reference, "doubt": result.doubt},
        "beyond": list(result.notes),
    }


def verdict(result: Convergence) -> str:
    """Return in words which rungs are the cheapest, and whether these are the defaults."""
    asked = {row.ladder for row in result.rungs if not row.default and not row.is_reference}
    lines = [_line(each) if each.ladder in asked else _alone(each) for each in result.ladders]
    if result.doubt is not None:
        lines.append(
            f"With its step doubled the exact beam's figures move by {UM * result.doubt:.2g} um."
        )
    exact = {row.case: row.growth_exact for row in result.rows}
    growing = [f"{case} at {rate:.2g} 1/s" for case, rate in exact.items() if rate > 0]
    if growing:
        lines.append(f"The exact linear loop grows: {', '.join(growing)}.")
    lines += [f"Note: {note}" for note in result.notes]
    return "\n".join(textwrap.fill(line, WIDTH, subsequent_indent="  ") for line in lines)


def _line(ladder: LadderRow) -> str:
    """Return what a ladder says."""
    usual = ladder.default is not None and ladder.cheapest == ladder.default
    if ladder.cheapest is None:
        found = "none is within"
    else:
        found = f"the cheapest within is {_bare(ladder.cheapest)}{', the default' * usual}"
    if ladder.unresolved:
        found += f"; not resolved: {', '.join(map(_bare, ladder.unresolved.split(', ')))}"
    if ladder.default is not None and not usual:
        why = f" ({ladder.why})" if ladder.why else ""
        found += f"; the default, {_bare(ladder.default)}, is {ladder.default_status}{why}"
    return f"{ladder.ladder}: {found}."


def _alone(ladder: LadderRow) -> str:
    """Return what is known of a default that nothing else was run beside."""
    why = f" ({ladder.why})" if ladder.why else ""
    usual = _bare(ladder.default or "-")
    return f"{ladder.ladder}: the default, {usual}, is {ladder.default_status}{why}."


def _bare(words: str) -> str:
    """Return a rung in words without the plant's name, as its ladder has it."""
    return words.partition(":")[2]
