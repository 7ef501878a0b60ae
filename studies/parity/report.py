"""What `flexsim modes` prints: every model beside the robot's own beam, and what a file changes.

>>> tables(compared(Robot()))[0].render()
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flexsim.arm.beam import MODES
from flexsim.mjcf.beams.beam_of import WRITTEN
from flexsim.numerics.types import Array
from studies.core.table import Column, Table
from studies.core.text import spelled
from studies.parity.side_by_side import ModesResult


@dataclass(frozen=True)
class ModeRow:
    """One frequency [Hz] in the three models."""

    mode: int
    exact: float
    assumed_modes: float
    chain: float

    @property
    def modes_difference(self) -> float:
        """Relative, of the assumed modes'."""
        return self.assumed_modes / self.exact - 1

    @property
    def chain_difference(self) -> float:
        """Relative, of the chain's."""
        return self.chain / self.exact - 1


@dataclass(frozen=True, eq=False)
class ShapeRow:
    """A figure of each mode (3,), and how it is written."""

    name: str
    figures: Array
    form: str


FREQUENCIES = (
    Column("mode", form="d"),
    Column("exact", form=".6f"),
    Column("assumed_modes", form=".6f"),
    Column("modes_difference", "difference", form="+.1e"),
    Column("chain", form=".6f"),
    Column("chain_difference", "difference", form="+.1e"),
)


def _mode(i: int) -> Column:
    return Column(f"mode {i + 1}", form=lambda row: format(row.figures[i], row.form))


SHAPES = (Column("name", ""), *map(_mode, range(MODES)))


def _frequencies(models: dict[str, Array]) -> list[ModeRow]:
    """Return frequencies mode by mode."""
    columns = (models[name] for name in ("exact", "assumed_modes", "chain"))
    return [ModeRow(i, *map(float, row)) for i, row in enumerate(zip(*columns, strict=True), 1)]


def _shapes(result: ModesResult) -> Iterator[ShapeRow]:
    """Give couplings with the chain's errors, the MAC, and damping ratios."""
    for name, models in result.couplings.items():
        for model, figures in models.items():
            label = f"{name}, beam" if model == "exact" else f"  {spoken(model)}"
            yield ShapeRow(label, figures, "+.7f")
        yield ShapeRow("  difference", models["chain"] / models["exact"] - 1, "+.1e")
    yield ShapeRow("MAC, chain to beam", result.mac, ".6f")
    for joints, found in (
        ("clamped", result.damping_ratio),
        ("joints free", result.joint_free_damping_ratio),
    ):
        for model, ratios in found.items():
            label = f"damping ratio, {joints}, beam" if model == "exact" else f"  {spoken(model)}"
            yield ShapeRow(label, ratios, ".6f")


@dataclass(frozen=True)
class ChangeRow:
    """A figure of the robot's beam [Hz, SI], and the default's."""

    name: str
    default: float
    yours: float

    @property
    def change(self) -> str:
        """Relative, or in words where there was nothing."""
        if abs(self.yours - self.default) <= SAME * abs(self.default):
            return "none"
        return f"{100 * (self.yours / self.default - 1):+.3f} %" if self.default else "new"


SAME = 1e-6  # relative: less than tables show
CHANGES = (
    Column("name", ""),
    Column("default", form=".6g"),
    Column("yours", form=".6g"),
    Column("change"),
)
UNITS = {"L": "m", "EI": "N m2", "rho": "kg/m", "r": "m", "zeta": "-", "payload": "kg"}
EXACT = {  # figures of the beam alone, by the result's names
    "clamped_hz": "clamped {} (Hz)",
    "joint_free_hz": "joints free {} (Hz)",
    "damping_ratio": "damping ratio, clamped {}",
    "joint_free_damping_ratio": "damping ratio, joints free {}",
}


def changes(result: ModesResult) -> list[ChangeRow]:
    """Return the beam's figures beside the default's: its numbers, then how it vibrates."""
    own, usual = result.beam, result.default["beam"]
    rows = [
        ChangeRow(f"{name} ({UNITS.get(name, 'kg m2')})", usual[name], float(own[name]))
        for name in WRITTEN
    ]
    rows += [
        ChangeRow(label.format(i + 1), *map(float, (result.default[key][i], exact[i])))
        for key, label in EXACT.items()
        for exact in [getattr(result, key)["exact"]]
        for i in range(MODES)
    ]
    compliance = result.default["static_compliance"], result.static_compliance["exact"]
    rows.append(ChangeRow("static tip compliance (m/N)", *compliance))
    return [row for row in rows if row.default or row.yours]


def spoken(model: str) -> str:
    """Return a model's name as text has it."""
    return model.replace("_", " ")


def tables(result: ModesResult) -> list[Table]:
    """Return frequencies, couplings and shapes; then what differs from the default beam, if any."""
    rows = changes(result)
    changed = any(row.change != "none" for row in rows)
    whose = "the robot's own beam" if changed else f"{result.default['name']} beam"
    solved = "" if result.beam["method"] == "exact" else ", by finite elements"
    title = (
        f"Chain: {spelled(result.source)}; exact: {whose}{solved}\n\nClamped beam, frequencies (Hz)"
    )
    free = "Both joints free, straight arm, frequencies (Hz)"
    shown = [
        Table(_frequencies(result.clamped_hz), FREQUENCIES, title),
        Table(_frequencies(result.joint_free_hz), FREQUENCIES, free),
        Table(list(_shapes(result)), SHAPES, "Couplings and tip values of the modes"),
    ]
    if not changed:
        return shown
    against = f"The beam beside {result.default['name']} one; as a uniform one, then exact"
    return [*shown, Table(rows, CHANGES, against)]


def verdict(result: ModesResult) -> str:
    """Return in words what differs at most, and what bounds the step."""
    compliance, omega = result.static_compliance, result.omega_max
    text = (
        f"Static tip compliance (m/N): exact {compliance['exact']:.6f}, assumed modes "
        f"{compliance['assumed_modes']:.6f}, chain {compliance['chain']:.6f}\n"
        "Largest of the chain's differences in couplings and compliance: "
        f"{100 * result.coupling_error_max:.3f} %\n"
        f"Highest frequency (rad/s): assumed modes {omega['assumed_modes']:.0f}, chain "
        f"{omega['chain']:.0f}\n"
    )
    if result.step_limit is not None:
        text += (
            f"The chain's step of {1e3 * result.step:g} ms is within its integrator's limit of "
            f"{1e3 * result.step_limit:.2f} ms\n"
        )
    return text + "".join(f"Note: {spelled(remark)}\n" for remark in result.remarks)
