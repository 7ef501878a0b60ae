"""Who is not dominated in error and effort, by trajectory and condition.

>>> front_rows(judge)
"""

from __future__ import annotations

import numpy as np

from flexsim.numerics.types import Array
from studies.arena.conditions import CORE
from studies.arena.rows import FrontRow
from studies.arena.search import front
from studies.arena.verdicts.judging import Judge

WHERE = ("condition", "level", "trajectory", "reference", "plant")


def front_rows(judge: Judge) -> list[FrontRow]:
    """Return of every trajectory under every condition which of the core's runs are on its fronts.

    One front by total variation, one by rms of the torques; plants are those that all conditions
    are run on.
    """
    of, core = judge.of, judge.of["tuning"] == CORE
    efforts = {
        "variation": of["variation_1"] + of["variation_2"],
        "rms": np.hypot(of["rms_torque_1"], of["rms_torque_2"]),
    }
    groups: dict[tuple[str, ...], list[int]] = {}
    for where, mask in judge.cases(core & judge.scored & np.isfinite(judge.index)):
        reference = AS_TUNED if where["reference"] == judge.own_reference(where["class"]) else ""
        for i in np.flatnonzero(mask):
            its = where | {"trajectory": str(of["trajectory"][i])}
            its["reference"] = reference or where["reference"]
            groups.setdefault(tuple(its[name] for name in WHERE), []).append(int(i))
    rows = []
    for where_, members in groups.items():
        for measure, effort in efforts.items():
            points = np.column_stack([effort[members], judge.index[members]])
            rows += [_row(judge, members[k], where_, measure, points[k]) for k in front(points)]
    return rows


AS_TUNED = "as tuned"  # a class's own reference: plain, or its shaper's


def _row(judge: Judge, run: int, where: tuple[str, ...], measure: str, point: Array) -> FrontRow:
    of = dict(zip(WHERE, where, strict=True))
    who, seed = str(judge.of["class"][run]), int(judge.of["seed"][run])
    effort, index = point.tolist()
    return FrontRow(who, seed, **of, measure=measure, effort=effort, index=index)
