"""What do filters look like, and how good are they? One fractional operator, or a controller's two.

result = run(FilterConfig(order=-0.5, realisation="tustin-fraction", terms=5))
result.b, result.a, result.magnitude_error_db

Either is also written for elsewhere, as sections: `--export circle.h`, `.m`, `.py` or `.json`.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from controllers import Array, frequency_response, operator, response_error
from controllers.errors import ControllerError, check_finite
from flexsim.errors import ParameterError
from flexsim.numerics.clocks import PERIOD
from studies.core.console import console
from studies.core.folder import to_json
from studies.core.table import Column, Table
from studies.core.text import spelled
from studies.tools import export
from studies.tools.controller_filters import ControllerFilters, filters_of
from studies.tuning.found import controller_of

FREQUENCIES = 12
"""Number of frequencies shown."""
LOWEST_HZ = 0.1
"""First of them, unless the Nyquist frequency is below 100 Hz: then 1/1000 of that."""


@dataclass(frozen=True)
class FilterConfig:
    """The operator gain * D^order and the way to realise it; or a controller, as it runs."""

    order: float | None = None
    """Order nu of the operator, any real number; negative integrates. Needed without
    --controller."""
    controller: str | None = None
    """Instead of an operator, a controller by its name, as in flexsim stability, or the folder of a
    run of flexsim tune; a name comes before a folder, ./line is the folder."""
    gain: float | None = None
    """Gain in front of the operator; 1 unless given."""
    realisation: str | None = None
    """tustin, gruenwald-letnikov, impulse-response, tustin-fraction, backward-fraction
    or oustaloup; tustin unless given."""
    terms: int | None = None
    """Length: the p of (2) for the first three, the number of poles for the others; 10 unless
    given."""
    period: float | None = None
    """Sampling period [s]; 1 ms unless given. A run of flexsim tune has its own, as of all
    these."""
    export: Path | None = None
    """File to write the filters to, as sections; none unless given."""
    format: Literal["c", "matlab", "python-control", "json"] | None = None
    """Of that file; what its suffix says unless given: .h, .m, .py or .json."""
    force: bool = False
    """Overwrite the file named by --export."""
    json: bool = False
    """Print one JSON object instead of tables."""


@dataclass(frozen=True)
class Operator:
    """The operator gain * D^order and the way to realise it, every number known."""

    order: float
    gain: float
    realisation: str
    terms: int
    period: float

    @property
    def words(self) -> str:
        """In one line."""
        how = f"{self.realisation}, {self.terms} terms, T = {self.period:g} s"
        return f"{self.gain:g} D^{self.order:g}, {how}"


@dataclass(frozen=True)
class FilterResult:
    """The filter, and its error against gain (j omega)^order."""

    asked: Operator
    b: Array
    """(m,) numerator in powers of z^-1."""
    a: Array
    """(n,) denominator in powers of z^-1, a[0] = 1."""
    omega: Array
    """(12,) angular frequencies, the last one Nyquist's [rad/s]."""
    magnitude_db: Array
    """(12,) magnitude of the response [dB]."""
    magnitude_error_db: Array
    """(12,) its error [dB]."""
    phase_error_deg: Array
    """(12,) error of the phase [deg]."""


def frequencies(period: float) -> Array:
    """Return the angular frequencies that are shown (12,) [rad/s], from 0.1 Hz to Nyquist."""
    nyquist_hz = 0.5 / period
    lowest_hz = min(LOWEST_HZ, 1e-3 * nyquist_hz)
    return 2.0 * math.pi * np.geomspace(lowest_hz, nyquist_hz, FREQUENCIES)


def operator_of(config: FilterConfig) -> Operator:
    """Return the operator asked for, with the usual numbers where none are given.

    Raises:
        ParameterError: there is no order.
    """
    if config.order is None:
        raise ParameterError("filter: give --order NU for an operator, or --controller NAME or RUN")
    return Operator(
        config.order,
        1.0 if config.gain is None else config.gain,
        config.realisation or "tustin",
        10 if config.terms is None else config.terms,
        PERIOD if config.period is None else config.period,
    )


def run(config: FilterConfig) -> FilterResult:
    """Return an operator's coefficients and its error from 0.1 Hz to Nyquist.

    Raises:
        ParameterError: there is no order.
        ControllerError: an option is out of range.
    """
    asked = operator_of(config)
    if check_finite("gain", asked.gain) == 0.0:
        raise ControllerError("gain must not be zero, got 0; give any other number")
    b, a = operator(asked.realisation, asked.order, asked.period, asked.terms)
    with np.errstate(over="ignore"):
        b = asked.gain * b
    if not np.isfinite(b).all():
        raise ControllerError(
            f"gain {asked.gain:g} makes the filter overflow; choose a smaller one"
        )
    omega = frequencies(asked.period)
    error = response_error(b, a, asked.order, asked.gain, omega, asked.period)
    with np.errstate(divide="ignore"):
        magnitude_db = 20.0 * np.log10(np.abs(frequency_response(b, a, omega, asked.period)))
    return FilterResult(asked, b, a, omega, magnitude_db, error.magnitude_db, error.phase_deg)


def run_controller(config: FilterConfig) -> ControllerFilters:
    """Return a controller's two filters and their responses.

    Raises:
        ParameterError, RunError: there is no such controller; an option has no effect.
        ControllerError: an option is out of range.
    """
    if config.order is not None or config.gain is not None:
        extra = "--order" if config.order is not None else "--gain"
        raise ParameterError(
            f"{extra} is of an operator and --controller is none; give one of them"
        )
    found = controller_of(config.controller or "")
    asked = {"realisation": config.realisation, "terms": config.terms, "period": config.period}
    return filters_of(found, asked, frequencies)


def command(config: FilterConfig) -> None:
    """Print filters as tables or as one JSON object, or write them to a file.

    Raises:
        ParameterError, RunError: an option cannot be used, or the file not be written.
        ControllerError: an option is out of range.
    """
    if config.export is None:
        for name in ("format", "force"):
            if getattr(config, name):
                raise ParameterError(f"--{name} has no effect: nothing is written; add --export")
    else:
        export.check(config.export, config.format, config.force)
    found: ControllerFilters | FilterResult
    found = run(config) if config.controller is None else run_controller(config)
    content = as_dict(found) if isinstance(found, FilterResult) else found.as_dict()
    written = None if config.export is None else _write(config.export, config, found)
    if config.json:
        print(to_json(content | ({"export": str(config.export)} if written else {})))
    elif written:
        console().print(written, soft_wrap=True)
    else:
        for table in tables(found) if isinstance(found, FilterResult) else found.tables():
            console().print(table.render())


def _write(path: Path, config: FilterConfig, found: ControllerFilters | FilterResult) -> str:
    """Write filters to a file, and return what to say of it."""
    if isinstance(found, FilterResult):
        asked = found.asked
        what = export.of_operator((found.b, found.a), asked.words, asked.order, asked.period)
    else:
        what = export.of_controller(found.controller, found.filters, found.period)
    kind = export.write(path, what, config.format, config.force)
    parts = "; ".join(f"{part.name}: {part.words}" for part in what.parts)
    notes = "".join(f"\nNote: {note}" for note in what.notes)
    return f"{spelled(path)}: {kind}; {what.title}; {parts}{notes}"


def as_dict(result: FilterResult) -> dict[str, object]:
    """Return what JSON has: the operator, and the filter's coefficients, response and errors."""
    found = {name: each for name, each in vars(result).items() if name != "asked"}
    return vars(result.asked) | found


@dataclass(frozen=True)
class TapRow:
    """Coefficients at a delay, None beyond the last."""

    delay: str
    b: float | None
    a: float | None


@dataclass(frozen=True)
class ResponseRow:
    """The response at a frequency, and its errors."""

    hertz: float
    omega: float
    magnitude_db: float
    magnitude_error_db: float
    phase_error_deg: float


TAPS = (Column("delay"), Column("b", form=".10g", missing=""), Column("a", form=".10g", missing=""))
RESPONSE = (
    Column("hertz", "f", "Hz", ".4g"),
    Column("omega", "omega", "rad/s", ".4g"),
    Column("magnitude_db", "magnitude", "dB", ".3f"),
    Column("magnitude_error_db", "error", "dB", "+.3f"),
    Column("phase_error_deg", "phase error", "deg", "+.2f"),
)


def tables(result: FilterResult) -> list[Table]:
    """Return coefficients, and the response with its errors."""
    c = result.asked
    against = f"Response, and its error against {c.gain:g} (j omega)^{c.order:g}"
    taps = [
        TapRow(f"z^-{i}", *(float(x[i]) if i < x.size else None for x in (result.b, result.a)))
        for i in range(max(result.b.size, result.a.size))
    ]
    columns = (result.omega, result.magnitude_db, result.magnitude_error_db, result.phase_error_deg)
    responses = [
        ResponseRow(float(omega) / (2 * math.pi), float(omega), *map(float, figures))
        for omega, *figures in zip(*columns, strict=True)
    ]
    return [Table(taps, TAPS, c.words), Table(responses, RESPONSE, against)]
