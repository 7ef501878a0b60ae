"""What does one fractional operator look like as a digital filter, and how good is it?

result = run(FilterConfig(order=-0.5, realisation="tustin-fraction", terms=5))
result.b, result.a, result.magnitude_error_db
"""

import math
from dataclasses import dataclass

import numpy as np

from controllers import Array, frequency_response, operator, response_error
from controllers.errors import ControllerError, check_finite
from flexsim.numerics.clocks import PERIOD
from studies.core.console import console
from studies.core.folder import to_json
from studies.core.table import Column, Table

FREQUENCIES = 12
"""Number of frequencies shown."""
LOWEST_HZ = 0.1
"""First of them, unless the Nyquist frequency is below 100 Hz: then 1/1000 of that."""


@dataclass(frozen=True)
class FilterConfig:
    """The operator gain * D^order and the way to realise it."""

    order: float
    """Order nu of the operator, any real number; negative integrates."""
    gain: float = 1.0
    """Gain in front of the operator."""
    realisation: str = "tustin"
    """tustin, gruenwald-letnikov, impulse-response, tustin-fraction, backward-fraction
    or oustaloup."""
    terms: int = 10
    """Length: the p of (2) for the first three, the number of poles for the others."""
    period: float = PERIOD
    """Sampling period [s]."""
    json: bool = False
    """Print one JSON object instead of tables."""


@dataclass(frozen=True)
class FilterResult:
    """The filter, and its error against gain (j omega)^order."""

    config: FilterConfig
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


def run(config: FilterConfig) -> FilterResult:
    """Return the filter's coefficients and its error from 0.1 Hz to Nyquist.

    Raises:
        ControllerError: an option is out of range.
    """
    if check_finite("gain", config.gain) == 0.0:
        raise ControllerError("gain must not be zero, got 0; give any other number")
    b, a = operator(config.realisation, config.order, config.period, config.terms)
    with np.errstate(over="ignore"):
        b = config.gain * b
    if not np.isfinite(b).all():
        raise ControllerError(
            f"gain {config.gain:g} makes the filter overflow; choose a smaller one"
        )
    nyquist_hz = 0.5 / config.period
    lowest_hz = min(LOWEST_HZ, 1e-3 * nyquist_hz)
    omega = 2.0 * math.pi * np.geomspace(lowest_hz, nyquist_hz, FREQUENCIES)  # (12,)
    error = response_error(b, a, config.order, config.gain, omega, config.period)
    with np.errstate(divide="ignore"):
        magnitude_db = 20.0 * np.log10(np.abs(frequency_response(b, a, omega, config.period)))
    return FilterResult(config, b, a, omega, magnitude_db, error.magnitude_db, error.phase_deg)


def command(config: FilterConfig) -> None:
    """Print the filter of `config` as tables, or as one JSON object.

    Raises:
        ControllerError: an option is out of range.
    """
    result = run(config)
    if config.json:
        print(to_json(as_dict(result)))
        return
    for table in tables(result):
        console().print(table.render())


def as_dict(result: FilterResult) -> dict[str, object]:
    """Return what JSON has: the operator, and the filter's coefficients, response and errors."""
    asked = {name: each for name, each in vars(result.config).items() if name != "json"}
    return asked | {name: each for name, each in vars(result).items() if name != "config"}


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
    c = result.config
    heading = f"{c.gain:g} D^{c.order:g}, {c.realisation}, {c.terms} terms, T = {c.period:g} s"
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
    return [Table(taps, TAPS, heading), Table(responses, RESPONSE, against)]
