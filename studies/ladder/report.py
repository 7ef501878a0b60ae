"""The ladder in words and tables, and its Pareto fronts.

>>> verdict(result)      # doctest: +SKIP
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from flexsim.recording.traces import kind
from studies.core.evidence.digits import percent, with_interval
from studies.core.table import Column, Table
from studies.ladder.rows import IntegratorRow, LadderResult, PlantRow, Tips, tip

TARGETS = (1e-3, 1e-4, 1e-5)  # [m] of the verdict
MM, UM, MS = 1e3, 1e6, 1e3
NO = "n/a"  # of what a rung has not
ROUNDING = 1e-9  # of damping ratios, from differences of the one-step map
SAFE = 0.95  # of an integrator's limit: longer steps are none to take
IN_MUJOCO = ("chain", "untuned", "rule-of-thumb", "rod")  # kinds of plants


def front(costs: Sequence[float], errors: Sequence[float]) -> list[bool]:
    """Return which rows no other beats: none is as cheap and as near, and better in one."""
    pairs = list(zip(costs, errors, strict=True))
    return [
        math.isfinite(error)
        and not any(c <= cost and e <= error and (c, e) != (cost, error) for c, e in pairs)
        for cost, error in pairs
    ]


def mark_fronts(rows: Sequence[PlantRow], uncertainty: Mapping[str, float]) -> list[PlantRow]:
    """Return the rows with `pareto_` of each torque; errors count down to the uncertainty [m]."""
    costs = [row.us_per_ms for row in rows]
    small, large = (
        front(costs, [max(tip(row, torque) or 0.0, uncertainty[torque]) for row in rows])
        for torque in ("small", "large")
    )
    return [
        replace(row, pareto_small=one, pareto_large=other)
        for row, one, other in zip(rows, small, large, strict=True)
    ]


def _micrometres(value: float | None, doubt: float = 0.0) -> str:
    """Return a length in micrometres, two digits; what is below its doubt as that."""
    if value is None or not math.isfinite(value):
        return "ran away"
    if value < doubt:
        return f"< {UM * doubt:.2g}"
    return f"{UM * value:{'.2g' if UM * value < 10 else '.0f'}}"


def _hertz(key: str, heading: str) -> list[Column]:
    """Return the columns of three frequencies."""
    names = (f"{heading} 1", "2", "3")
    return [Column(key, name, form=".3f", index=i, missing="") for i, name in enumerate(names)]


def _tip(torque: str, doubt: float) -> Column:
    """Return the column of a torque's tip errors, a star on the Pareto front."""

    def text(row: PlantRow) -> str:
        star = "*" if getattr(row, f"pareto_{torque}") else " "
        return _micrometres(tip(row, torque), doubt) + star

    return Column(f"tip_{torque}", torque, "um rms ", text)


def _envelope(row: PlantRow) -> str:
    """Return the median envelope and its interval [mm], or when the first run was lost."""
    loop = row.loop
    if loop is None:
        return ""
    if loop.envelope is None:
        return f"lost, {loop.diverged_at:.2f} s"
    return with_interval(loop.envelope, *loop.interval("envelope"), scale=MM)


def _stable(form: Any, column: str = "") -> Any:
    """Return a cell's function that leaves it empty where a step is unstable."""
    return lambda row: form(row) if row.stable else column


def _damping(row: IntegratorRow) -> str:
    ratio = float(row.modal.damping_ratio[-1])
    return f"{ratio:.1e}" if abs(ratio) > ROUNDING else "0"


FREQUENCIES = (
    Column("plant", ""),
    *_hertz("clamped_hz", "clamped"),
    *_hertz("joint_free_hz", "free"),
)
AT_TIP = (
    Column("plant", ""),
    Column("rotation_error", "moment", "%", "+.1f", scale=100, missing=NO),
    *(
        Column("loaded_error", name, "%", "+.2f", scale=100, index=i, missing=NO)
        for i, name in enumerate(("loaded 1", "2", "3"))
    ),
)
INTEGRATORS = (
    Column("integrator", ""),
    Column("step", unit="ms", form="g", scale=MS),
    Column(
        "frequency_shift",
        "f3 shift",
        form=_stable(lambda row: f"{row.modal.frequency_shift[-1]:+.1e}", "unstable"),
    ),
    Column("damping_ratio", "zeta3", form=_stable(_damping)),
    Column("energy_drift", "energy", form=".1e", missing=""),
    Column("tip_small", "small", "um", _stable(lambda row: _micrometres(row.tip_small))),
    Column("tip_large", "large", "um", _stable(lambda row: _micrometres(row.tip_large))),
    Column("us_per_ms", "cost", "us/ms", ".1f", missing=""),
)


def tables(result: LadderResult) -> list[Table]:
    """Return frequencies, tips and costs of the plants; what the integrators do."""
    ref = result.reference
    exact = Tips(0.0, 0.0, 0.0, 0.0)
    beam = PlantRow("reference", 0.0, ref.clamped_hz, ref.joint_free_hz, exact, None)
    doubts = ", ".join(f"{UM * doubt:.2g} um ({name})" for name, doubt in ref.uncertainty.items())
    columns = (
        Column("plant", ""),
        Column("step", unit="ms", form="g", scale=MS),
        *(_tip(*each) for each in ref.uncertainty.items()),
        Column("envelope", unit="mm", form=_envelope),
        Column("us_per_ms", "cost", "us/ms", ".3g"),
    )
    return [
        Table(
            [beam, *result.rows],
            FREQUENCIES,
            "Frequencies (Hz), hub locked and both joints free",
            prints="rows.csv",
        ),
        Table(
            result.rows,
            columns,
            "Tip in open loop, small and large torques (*: Pareto front); envelope of one\n"
            "controller of the paper's ideal loop, median over changes of its gains' fourth\n"
            "digits with its 95 % interval; cost on one core",
            f"Reference: {ref.name};\nits own uncertainty {doubts}\n",
            key="rows",
            file="rows.csv",
        ),
        Table(
            result.rows,
            AT_TIP,
            "Errors at the tip: its static rotation under a moment there; frequencies, hub\n"
            "locked, under a payload as heavy as the beam, its radius of gyration 0.2 L",
            "Assumed modes: the sum over so many modes; those of the loaded beam, so that its\n"
            "frequencies are exact. n/a: no modes, no payload, a tip without rotation, or a\n"
            "beam of another code or of a file.",
            prints="rows.csv",
        ),
        Table(
            result.integrators,
            INTEGRATORS,
            "What mj_step does to the chain, by step: to mode 3, to the energy of free\n"
            "motion, to the tip (rms, against RK4 at a very short step); cost of mj_step",
            key="integrators",
            file="integrators.csv",
        ),
    ]


def facts(result: LadderResult) -> dict[str, Any]:
    """Return what the reference is, and its own uncertainty [m]."""
    ref = result.reference
    return {"reference": {"name": ref.name, "uncertainty": ref.uncertainty}}


def cheapest(rows: Sequence[Any], torque: str, target: float) -> Any:
    """Return the cheapest row whose tip is within a target [m] under a torque, None if none is."""
    good = [row for row in rows if (found := tip(row, torque)) is not None and found <= target]
    return min(good, key=lambda row: row.us_per_ms, default=None)


def _spoken(row: PlantRow | IntegratorRow | None) -> str:
    if row is None:
        return "none"
    if isinstance(row, PlantRow):
        return f"{row.plant} ({row.us_per_ms:.2g} us)"
    return f"{row.integrator} at {MS * row.step:g} ms ({row.us_per_ms:.2g} us)"


def verdict(result: LadderResult) -> str:
    """Return in words which plant is the cheapest for which accuracy, and which step."""
    in_mujoco = [row for row in result.rows if kind(row.plant) in IN_MUJOCO]
    steps = [row for row in result.integrators if row.step <= SAFE * (row.longest_step or 1)]
    lines = []
    for torque, doubt in result.reference.uncertainty.items():
        lines.append(
            f"Cheapest under {torque} torques (steps: up to {SAFE} of the limit), tip within"
        )
        for target in TARGETS:
            label = f"  {MM * target:g} mm: "
            if target < doubt:
                lines.append(f"{label}the reference does not tell")
                continue
            every = (cheapest(some, torque, target) for some in (result.rows, in_mujoco, steps))
            lines.append(label + "{}; in MuJoCo {}; steps: {}".format(*map(_spoken, every)))
    lines.append(_envelopes(result.rows))
    return "\n".join(lines)


def _envelopes(rows: Sequence[PlantRow]) -> str:
    """Return how far the envelopes tell the plants apart."""
    loops = [row.loop for row in rows if row.loop is not None]
    widths = [MM * loop.envelope for loop in loops if loop.envelope is not None]
    if not widths:
        return "Closed loop: lost on every rung."
    ends = f"from {min(widths):.1f} to {max(widths):.1f} mm"
    lost = "".join(f"\n  {_lost(row)}" for row in rows if row.loop and row.loop.diverged)
    halves = [
        MM * (loop.envelope_high - loop.envelope_low) / 2
        for loop in loops
        if loop.envelope_high is not None and loop.envelope_low is not None
    ]
    sure = f"by the gains' fourth digits known to {max(halves):.2g} mm or less" if halves else ""
    return f"Closed loop: median envelopes {ends} over the rungs{sure and ', '}{sure}.{lost}"


def _lost(row: PlantRow) -> str:
    """Return in words how large a share of a plant's runs diverged."""
    assert row.loop is not None
    ends = row.loop.diverged_share_low, row.loop.diverged_share_high
    return f"{row.plant}: {percent(row.loop.diverged_share, *ends)} of {row.loop.runs} diverged"
