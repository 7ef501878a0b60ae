"""Controllers as linear digital filters: from orders and gains to `(b, a)`.

Coefficients follow scipy.signal's convention, in powers of z^-1 with a[0] = 1, so
whatever scipy.signal can design or analyse fits beside these. What has too many poles for
one polynomial is a sum of cascades, `Sections`.
"""

from controllers.errors import ControllerError
from controllers.factored import Factored, factored, state_space
from controllers.fractions import backward_fraction, tustin_fraction
from controllers.operators import REALISATIONS, Realisation, operator
from controllers.oustaloup import oustaloup, oustaloup_cascade
from controllers.pid import (
    Controller,
    Gains,
    fractional_pid,
    integer_pid,
    oustaloup_pid,
    parallel,
    textbook_pid,
)
from controllers.published import TABLE_2
from controllers.response import ResponseError, frequency_response, response_error
from controllers.sections import Cascade, Sections
from controllers.series import Array, Filter, gruenwald_letnikov, impulse_response, tustin
from controllers.tuned import TUNED
from controllers.tuned_arms import TUNED_ARMS
from controllers.tuned_collocated import COLLOCATED, TextbookPid
from controllers.tuned_ideal import TUNED_IDEAL

__all__ = [
    "COLLOCATED",
    "REALISATIONS",
    "TABLE_2",
    "TUNED",
    "TUNED_ARMS",
    "TUNED_IDEAL",
    "Array",
    "Cascade",
    "Controller",
    "ControllerError",
    "Factored",
    "Filter",
    "Gains",
    "Realisation",
    "ResponseError",
    "Sections",
    "TextbookPid",
    "backward_fraction",
    "factored",
    "fractional_pid",
    "frequency_response",
    "gruenwald_letnikov",
    "impulse_response",
    "integer_pid",
    "operator",
    "oustaloup",
    "oustaloup_cascade",
    "oustaloup_pid",
    "parallel",
    "response_error",
    "state_space",
    "textbook_pid",
    "tustin",
    "tustin_fraction",
]
