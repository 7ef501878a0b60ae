"""Filters as a Python module of python-control's systems, numbers written out.

>>> text = python_control(exported)    # doctest: +SKIP

python-control itself is not needed to write it, only to import what was written.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from controllers import Filter, state_space
from flexsim.numerics.types import Array
from studies.tools.export.exported import Exported, Part
from studies.tools.export.numbers import listed, number

WIDTH = 96


def python_control(exported: Exported) -> str:
    """Return the text of a module.

    A filter of one section is a transfer function; of several a state space, since the product of
    their polynomials would lose the digits that sections keep. They are all there, too.
    """
    head = [text for line in exported.about for text in textwrap.wrap(line, WIDTH)]
    names = ", ".join(f'"{part.name}": {part.name}' for part in exported.parts)
    return "\n".join(
        [
            '"""Written by flexsim filter --export.',
            "",
            *head,
            '"""',
            "",
            "import control",
            "",
            f"period = {number(exported.period)}  # [s]",
            "",
            *(line for part in exported.parts for line in _part(part)),
            f"systems = {{{names}}}",
            "",
        ]
    )


def _part(part: Part) -> Iterator[str]:
    """Give the lines of one filter."""
    yield f"# {part.name}: a sum of cascades, each of sections in series"
    yield f"{part.name}_sections = ["
    for cascade in part.sections.cascades:
        yield "    ["
        for section in cascade:
            yield from _transfer(section, "        ", "        ", ",")
        yield "    ],"
    yield "]"
    cascades = part.sections.cascades
    if len(cascades) == len(cascades[0]) == 1:
        yield f"{part.name} = {part.name}_sections[0][0]"
    else:
        yield f"{part.name} = control.ss("
        for matrix in state_space(part.sections):
            yield f"    {_matrix(matrix)},"
        yield "    period,"
        yield ")"
    yield ""


def _transfer(section: Filter, indent: str, first: str, end: str) -> Iterator[str]:
    """Give the lines of a transfer function in powers of z, the highest first."""
    longest = max(each.size for each in section)
    yield f"{first}control.tf("
    for values in section:
        padded = [*values, *[0.0] * (longest - values.size)]
        yield f"{indent}    [{listed(padded, f'{indent}     ')}],"
    yield f"{indent}    period,"
    yield f"{indent}){end}"


def _matrix(matrix: Array) -> str:
    rows = (f"[{listed(row, '      ')}]" for row in matrix)
    return "[" + ",\n     ".join(rows) + "]"
