"""Controllers of other arms than the paper's, `TUNED_ARMS`, by the arm each was tuned for.

    (b1, a1), (b2, a2) = TUNED_ARMS["one-link"].filters(period=1e-3)

`source` is the command that found each, an outcome of a random search, nothing optimal. That of
`one-link` is of the paper's structure, (1)-(4) with p = 10 at 1 ms, for ideal hardware and a sample
of delay, its gains as the search has them, for time counted in milliseconds. That of `two-flexible`
is textbook PDs that ignore v, for a bench with two samples of delay: joint 2 is soft and damps.
"""

from collections.abc import Mapping
from types import MappingProxyType

from controllers.pid import Controller, Gains
from controllers.tuned_collocated import TextbookPid

_ONE_LINK = (
    "flexsim tune --arm one-link --trajectory turn --plant assumed-modes --setting none "
    "--hardware ideal delayed --distribution wide --tuner cma --population 20 --generations 40 "
    "--exact --exact-spread 0.2 --effort 1e-8 --long-hold 10 --residual 0.1"
)

_TWO_FLEXIBLE = (
    "flexsim tune --arm two-flexible --trajectory line --plant closed-chain --setting none "
    "--controller pid --realisation textbook --filter-time 0.003 --v-gain 0 --hardware bench "
    "--hardware-delay 2 --distribution controllers/two_flexible.toml --tuner cma --population 12 "
    "--generations 30 --exact --exact-spread 0.2 --effort 1e-6 --long-hold 20 --residual 0.1"
)

TUNED_ARMS: Mapping[str, Controller | TextbookPid] = MappingProxyType(
    {
        "one-link": Controller(
            name="one-link",
            joint1=Gains.from_milliseconds(
                k1=59.49648687597921,
                nu1=0.6174075469730217,
                k2=68.45362504116767,
                nu2=0.3041254994510489,
                k3=-694.7524100822347,
            ),
            joint2=Gains.from_milliseconds(
                k1=167.87919751882305,
                nu1=0.3496452179301778,
                k2=83.94473904431364,
                nu2=-0.04358077978517827,
                k3=-91.64993962473486,
            ),
            source=_ONE_LINK,
        ),
        "two-flexible": TextbookPid(
            name="two-flexible",
            joint1=(166.38048194310778, 0.0, 0.4519802486358312),
            joint2=(2.0, 0.0, 3.1271447690416942),
            filter_time=0.003,
            source=_TWO_FLEXIBLE,
        ),
    }
)
"""The first joint of `one-link` stands still: its controller does nothing."""
