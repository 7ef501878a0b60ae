"""Filters as a MATLAB function that Octave runs too: `filter`, section by section.

>>> text = matlab(exported, "my_controller")    # doctest: +SKIP
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator

from controllers import Filter
from controllers.factored import SECOND
from controllers.sections import Cascade
from flexsim.errors import ParameterError
from studies.tools.export.exported import Exported
from studies.tools.export.numbers import listed, number

WIDTH = 96
LONGEST = 63  # characters of a name in MATLAB
TAKEN = frozenset(  # words of the language, and what the function calls itself
    "break case catch classdef continue else elseif end for function global if otherwise "
    "parfor persistent return spmd switch try while do until unwind_protect endfunction "
    "filter zeros size numel cell isempty nargin".split()
)
BODY = """\
  parts = coefficients();
  if nargin == 0
    output = parts;
    state = {};
    return
  end
  if nargin < 2 || isempty(state)
    state = cell(1, numel(parts));
  end
  output = zeros(size(input, 1), numel(parts));
  for j = 1:numel(parts)
    [output(:, j), state{j}] = summed(parts{j}.cascades, input(:, j), state{j});
  end
end

function [output, state] = summed(cascades, input, state)
% Cascades side by side.
  if isempty(state)
    state = cell(1, numel(cascades));
  end
  output = zeros(size(input));
  for k = 1:numel(cascades)
    [passed, state{k}] = passed_on(cascades{k}, input, state{k});
    output = output + passed;
  end
end

function [passed, state] = passed_on(cascade, passed, state)
% Sections one after the other: rows [b0 b1 b2 a0 a1 a2], then what is longer.
  rows = size(cascade.sos, 1);
  longer = numel(cascade.b);
  if isempty(state)
    state = cell(1, rows + longer);
  end
  for s = 1:rows
    [passed, state{s}] = filter(cascade.sos(s, 1:3), cascade.sos(s, 4:6), passed, state{s});
  end
  for s = 1:longer
    [passed, state{rows + s}] = filter(cascade.b{s}, cascade.a{s}, passed, state{rows + s});
  end
end
"""


def check_name(name: str) -> str:
    """Return the name of a function.

    Raises:
        ParameterError: MATLAB could not call it.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or len(name) > LONGEST or name in TAKEN:
        raise ParameterError(
            f"{name!r} is no name of a MATLAB function, which is called after its file; give "
            "letters, digits and underscores, a letter first, and no word of MATLAB's own"
        )
    return name


def matlab(exported: Exported, name: str) -> str:
    """Return the text of a function file.

    Raises:
        ParameterError: MATLAB could not call a function of this name.
    """
    check_name(name)
    columns = ", ".join(part.name for part in exported.parts)
    lines = [
        "Written by flexsim filter --export.",
        *exported.about,
        f"[output, state] = {name}(input) filters columns ({columns}), a row in every sampling "
        "period.",
        f"[output, state] = {name}(input, state) goes on from a state.",
        f"parts = {name}() returns the sections.",
    ]
    head = [text for line in lines for text in textwrap.wrap(line, WIDTH - 2)]
    return "\n".join(
        [
            f"function [output, state] = {name}(input, state)",
            *(f"% {line}" for line in head),
            f"{BODY}",
            "function parts = coefficients()",
            f"% Sampling period: {number(exported.period)} s",
            f"  parts = cell(1, {len(exported.parts)});",
            *_coefficients(exported),
            "end",
            "",
        ]
    )


def _coefficients(exported: Exported) -> Iterator[str]:
    """Give the lines that fill the sections in."""
    for j, part in enumerate(exported.parts, start=1):
        yield f"  parts{{{j}}}.name = '{part.name}';"
        yield f"  parts{{{j}}}.period = {number(exported.period)};"
        for k, cascade in enumerate(part.sections.cascades, start=1):
            yield from _cascade(f"parts{{{j}}}.cascades{{{k}}}", cascade)


def _cascade(place: str, cascade: Cascade) -> Iterator[str]:
    rows = [each for each in cascade if _is_row(each)]
    longer = [each for each in cascade if not _is_row(each)]
    if rows:
        yield f"  {place}.sos = [ ..."
        for b, a in rows:
            six = [*b, *[0.0] * (3 - b.size), *a, *[0.0] * (3 - a.size)]
            yield f"    {listed(six, '      ', ' ...')}; ..."
        yield "  ];"
    else:
        yield f"  {place}.sos = zeros(0, 6);"
    yield f"  {place}.b = cell(1, {len(longer)});"
    yield f"  {place}.a = cell(1, {len(longer)});"
    for s, section in enumerate(longer, start=1):
        for letter, values in zip("ba", section, strict=True):
            yield f"  {place}.{letter}{{{s}}} = [ ..."
            yield f"    {listed(values, '    ', ' ...')} ..."
            yield "  ];"


def _is_row(section: Filter) -> bool:
    return max(section[0].size, section[1].size) - 1 <= SECOND
