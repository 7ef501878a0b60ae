"""What columns are called, in which unit, and what they mean, where their name is known.

>>> known("envelope_low").unit, known("envelope").meaning
('m', 'largest distance of the tip from the path')
"""

from __future__ import annotations

from typing import NamedTuple

from studies.run.columns import COUNTERS, DIVERGED, FIGURES, TRACES

ENDS = ("_low", "_high")  # of an interval
PARTS = (*ENDS, "_quartile_1", "_quartile_3")
PLAIN = ("-", "")
SCALED = {"m": ("mm", 1e3)}  # lengths of this arm are read in millimetres


class Known(NamedTuple):
    """A column's unit and meaning, empty where they are not known."""

    unit: str = ""
    meaning: str = ""


NAMES: dict[str, Known] = {
    **{name: Known(unit, meaning) for name, unit, meaning in TRACES},
    **{each.name: Known(each.unit, each.meaning) for each in FIGURES},
    **{name: Known("", meaning) for name, meaning in COUNTERS},
    "diverged": Known("", "whether, or how many, runs left the workspace"),
    "diverged_at": Known("s", DIVERGED[1][1].partition(";")[0]),
    "diverged_share": Known("", "share of the runs that diverged"),
    "bounded_share": Known("", "share of the runs that stayed bounded"),
    "stable_share": Known("", "share of the individuals that stayed bounded"),
    "runs": Known("", "runs behind the figures"),
    "ratio": Known("", "to what it is held against"),
    "difference": Known("", "from what it is held against, in the figure's unit"),
    "median": Known("", "over the runs, in the row's unit"),
    "low": Known("", "lower end of the 95 % interval"),
    "high": Known("", "upper end of the 95 % interval"),
    "tip_difference": Known("m", "rms distance of two plants' tips"),
    "dead_zone_error": Known("m", "what the dead zone of joint 2 hides, at the tip"),
    "paper_simulation": Known("m", "the paper's envelope, simulated"),
    "paper_laboratory": Known("m", "the paper's envelope, in its laboratory"),
    "from_envelope": Known("m", FIGURES[0].meaning),
    "to_envelope": Known("m", FIGURES[0].meaning),
    "envelope_none": Known("m", "envelope without friction"),
    "envelope_simulink": Known("m", "envelope in the setting simulink"),
    "envelope_change": Known("m", "envelope, less the reference's"),
    "rms_error_change": Known("m", "rms error, less the reference's"),
    "max_v_change": Known("m", "largest deflection, less the reference's"),
    "envelope_margin": Known("m", "within which the change must lie"),
    "rms_error_margin": Known("m", "within which the change must lie"),
    "max_v_margin": Known("m", "within which the change must lie"),
    "tip_small": Known("m", "rms distance of the tips under small torques"),
    "tip_large": Known("m", "rms distance of the tips under large torques"),
    "peak_small": Known("m", "largest distance of the tips under small torques"),
    "peak_large": Known("m", "largest distance of the tips under large torques"),
    "tip_to_chain": Known("m", "rms distance of the tips"),
    "tip_to_consistent": Known("m", "rms distance of the tips"),
    "clamped_hz": Known("Hz", "frequencies with both joints held"),
    "joint_free_hz": Known("Hz", "frequencies with joint 2 free"),
    "fastest_hz": Known("Hz", "frequency of the pole that grows fastest"),
    "zero_hz": Known("Hz", "frequency of the zero"),
    "zero_decay": Known("1/s", "rate at which the zero's motion decays"),
    "pole_hz": Known("Hz", "frequency of the pole"),
    "pole_decay": Known("1/s", "rate at which the pole's motion decays"),
    "growth_exact": Known("1/s", "of v, in the exact linear loop"),
    "growth_undamped": Known("1/s", "of v, without any damping"),
    "growth_stepped": Known("1/s", "of v, in the loop as it is stepped"),
    "growth_simulated": Known("1/s", "of v, in a simulation"),
    "growth_friction": Known("1/s", "of v, with friction's slope"),
    "delay_margin": Known("s", "extra delay of both torques that is borne"),
    "gain_margin": Known("", "factor of the loop gains that is borne"),
    "theta2": Known("rad", "angle of joint 2"),
    "zeta": Known("", "damping ratio of mode 1"),
    "step": Known("s", "of the integration"),
    "longest_step": Known("s", "up to which the integrator is stable"),
    "us_per_ms": Known("us/ms", "cost of a simulated millisecond"),
    "best": Known("m2 s", "best performance index (5) so far"),
    "best_index": Known("m2 s", "best performance index (5)"),
    "magnitude_rms_db": Known("dB", "error of the magnitude, root mean square"),
    "magnitude_max_db": Known("dB", "error of the magnitude, largest"),
    "phase_rms_deg": Known("deg", "error of the phase, root mean square"),
    "phase_max_deg": Known("deg", "error of the phase, largest"),
    "cost_ns": Known("ns", "cost of a sample"),
    "residual_v": Known("m", "largest tip deflection over the hold"),
    "growth": Known("1/s", "rate at which v grows"),
}


def known(name: str) -> Known:
    """Return what is known of a column, of an interval's or quartiles' ends as of its figure."""
    if name in NAMES:
        return NAMES[name]
    base = name
    for part in PARTS:
        base = base.removesuffix(part)
    stem, _, number = base.rpartition("_")
    return NAMES.get(base) or NAMES.get(stem if number.isdigit() else "", Known())


def in_words(name: str) -> str:
    """Return a column's name as text has it."""
    return name.replace("_", " ")


def scaled(unit: str) -> tuple[str, float]:
    """Return the unit that a figure is drawn in, and the factor to it."""
    return SCALED.get(unit, ("" if unit in PLAIN else unit, 1.0))
