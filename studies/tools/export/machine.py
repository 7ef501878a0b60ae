"""Filters as JSON, for any program.

>>> text = machine_readable(exported)    # doctest: +SKIP
"""

from __future__ import annotations

from studies.core.folder import to_json
from studies.tools.export.exported import Exported

FORMAT, VERSION = "flexsim-filters", 1
MEANING = (
    "each filter is the sum of its cascades, a cascade its sections in series, a section "
    "y[n] = sum b[i] x[n-i] - sum a[i] y[n-i], i from 1 in the latter, a[0] = 1"
)


def machine_readable(exported: Exported) -> str:
    """Return the text of a JSON object; numbers read back to the same doubles."""
    content = {
        "format": FORMAT,
        "version": VERSION,
        "title": exported.title,
        "source": exported.source,
        **exported.facts,
        "period": exported.period,
        "period_unit": "s",
        "kind": MEANING,
        "filters": [
            {
                "name": part.name,
                "takes": part.takes,
                "gives": part.gives,
                "input_unit": part.units[0],
                "output_unit": part.units[1],
                "cascades": [
                    [{"b": b, "a": a} for b, a in cascade] for cascade in part.sections.cascades
                ],
                "whole": list(part.factored.whole),
            }
            for part in exported.parts
        ],
        "notes": exported.notes,
    }
    return to_json(content) + "\n"
