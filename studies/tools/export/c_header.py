"""Filters as a C99 header that needs nothing else: coefficients, state, step, reset.

>>> text = c_header(exported)    # doctest: +SKIP
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterator

from controllers import Filter
from studies.core.text import word
from studies.tools.export.exported import Exported, Part
from studies.tools.export.numbers import listed, number

WIDTH = 96
SECTION = """\
/* One section in transposed direct form II: b and a of z^0 to z^-order, a[0] = 1. */
static inline double flexsim_section(const double *b, const double *a, int order, double *z,
                                     double x)
{
    const double y = b[0] * x + z[0];
    int i;
    for (i = 1; i < order; i++)
        z[i - 1] = b[i] * x + z[i] - a[i] * y;
    z[order - 1] = b[order] * x - a[order] * y;
    return y;
}

/* Taps alone: b of z^0 to z^-order. */
static inline double flexsim_taps(const double *b, int order, double *z, double x)
{
    const double y = b[0] * x + z[0];
    int i;
    for (i = 1; i < order; i++)
        z[i - 1] = b[i] * x + z[i];
    z[order - 1] = b[order] * x;
    return y;
}
"""
RESET = """\
/* Forget all that was. */
static inline void flexsim_reset(flexsim_state *state)
{
    int i;
    for (i = 0; i < FLEXSIM_MEMORY; i++)
        state->memory[i] = 0.0;
}
"""


def c_header(exported: Exported) -> str:
    """Return the text of a header: one controller, for one translation unit."""
    guard = f"FLEXSIM_{word(exported.title).replace('-', '_').upper()}_H"
    memory, blocks, sizes = 0, [], []
    for part in exported.parts:
        text, size = _part(part, memory)
        blocks.append(text)
        sizes.append(f" * memory[{memory}] on: of {part.name}" if size else "")
        memory += size
    names = ", ".join(_constant(part) for part in exported.parts)
    return "\n".join(
        [
            _head(exported),
            f"#ifndef {guard}",
            f"#define {guard}",
            "",
            "#ifdef FLEXSIM_PERIOD",
            '#error "one controller of flexsim in a translation unit"',
            "#endif",
            f"#define FLEXSIM_PERIOD {number(exported.period)} /* [s] */",
            f"#define FLEXSIM_MEMORY {max(memory, 1)}",
            "",
            f"enum {{ {names} }};",
            "",
            "typedef struct {",
            "    double memory[FLEXSIM_MEMORY];",
            "} flexsim_state;",
            "",
            RESET,
            SECTION,
            *blocks,
            _step(exported),
            f"#endif /* {guard} */",
            "",
        ]
    )


def _head(exported: Exported) -> str:
    """Return the comment at the top: what it is, and how it is used."""
    first = exported.parts[0]
    lines = ["Written by flexsim filter --export.", ""]
    for line in exported.about:
        lines += textwrap.wrap(line, WIDTH - 3)
    lines += [
        "",
        "    flexsim_state state;",
        "    flexsim_reset(&state);",
        f"    y = flexsim_step(&state, {_constant(first)}, x); once in every sampling period",
    ]
    return "\n".join(["/*", *(f" * {line}".rstrip() for line in lines), " */"])


def _constant(part: Part) -> str:
    return f"FLEXSIM_{part.name.upper()}"


def _part(part: Part, memory: int) -> tuple[str, int]:
    """Return a filter's coefficients and function, and how much memory it takes, from where."""
    arrays, body, size = [], [], 0
    for k, cascade in enumerate(part.sections.cascades, start=1):
        body.append("    p = x;")
        for s, section in enumerate(cascade, start=1):
            name = f"flexsim_{part.name}_{k}_{s}"
            arrays += list(_arrays(name, section))
            call, order = _call(name, section, memory + size)
            body.append(f"    p = {call};")
            size += order
        body.append("    y += p;")
    text = [
        *arrays,
        f"/* {part.name}: {part.words}. */",
        f"static inline double flexsim_{part.name}(double *memory, double x)",
        "{",
        "    double p, y = 0.0;",
        *(["    (void)memory;"] if not size else []),
        *body,
        "    return y;",
        "}",
        "",
    ]
    return "\n".join(text), size


def _order(section: Filter) -> int:
    return max(section[0].size, section[1].size) - 1


def _arrays(name: str, section: Filter) -> Iterator[str]:
    """Give the coefficients of a section, padded to its order."""
    order = _order(section)
    for letter, values in zip("ba", section, strict=True):
        if letter == "b" or values.size > 1:
            padded = [*values, *[0.0] * (order + 1 - values.size)]
            yield f"static const double {name}_{letter}[{order + 1}] = {{"
            yield f"    {listed(padded, '    ')}"
            yield "};"


def _call(name: str, section: Filter, place: int) -> tuple[str, int]:
    """Return how a section is run, and how many numbers it remembers."""
    order = _order(section)
    if order == 0:
        return f"{name}_b[0] * p", 0
    if section[1].size == 1:
        return f"flexsim_taps({name}_b, {order}, memory + {place}, p)", order
    return f"flexsim_section({name}_b, {name}_a, {order}, memory + {place}, p)", order


def _step(exported: Exported) -> str:
    """Return the function that is called once in every sampling period, for every filter."""
    cases = [
        f"    case {_constant(part)}:\n        return flexsim_{part.name}(state->memory, x);"
        for part in exported.parts
    ]
    return "\n".join(
        [
            "/* The output of a filter at its next input; 0 of one that there is not. */",
            "static inline double flexsim_step(flexsim_state *state, int part, double x)",
            "{",
            "    switch (part) {",
            *cases,
            "    default:",
            "        return 0.0;",
            "    }",
            "}",
            "",
        ]
    )
