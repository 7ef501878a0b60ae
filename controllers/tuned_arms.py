"""Controllers of other arms than the paper's, `TUNED_ARMS`, by the arm each was tuned for.

    (b1, a1), (b2, a2) = TUNED_ARMS["one-link"].filters(period=1e-3)

Of the paper's structure, (1)-(4) with p = 10 at 1 ms; `source` is the command that found them, an
outcome of a random search, nothing optimal. The worst counts of ideal hardware and of one sample of
delay. Gains are as the search has them, for time counted in milliseconds.
"""

from collections.abc import Mapping
from types import MappingProxyType

from controllers.pid import Controller, Gains

_ONE_LINK = (
    "flexsim tune --arm one-link --trajectory turn --plant assumed-modes --setting none "
    "--hardware ideal delayed --distribution wide --tuner cma --population 20 --generations 40 "
    "--exact --exact-spread 0.2 --effort 1e-8 --long-hold 10 --residual 0.1"
)

TUNED_ARMS: Mapping[str, Controller] = MappingProxyType(
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
    }
)
"""The first joint of `one-link` stands still: its controller does nothing."""
