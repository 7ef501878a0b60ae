"""Controllers of a short search, whose loops near rest are of three kinds, as tests need them.

Without friction the two-loop's is unstable, and the circle's has gain margins on both sides.
"""

from collections.abc import Mapping
from types import MappingProxyType

from controllers import Controller, Gains

_SOURCE = "short run of the genetic algorithm of section 3.2 on the {} trajectory"

TRIAL: Mapping[str, Controller] = MappingProxyType(
    {
        "line": Controller(
            name="line",
            joint1=Gains.from_milliseconds(
                k1=8635.0, nu1=0.05823, k2=2.289, nu2=0.01212, k3=-0.07983
            ),
            joint2=Gains.from_milliseconds(
                k1=98.07, nu1=0.4938, k2=1.049, nu2=0.002315, k3=-0.1796
            ),
            source=_SOURCE.format("line"),
        ),
        "two-loop": Controller(
            name="two-loop",
            joint1=Gains.from_milliseconds(
                k1=10110.0, nu1=0.5456, k2=0.9018, nu2=-0.1107, k3=0.09091
            ),
            joint2=Gains.from_milliseconds(k1=94.22, nu1=0.4840, k2=1.076, nu2=-0.1937, k3=0.0112),
            source=_SOURCE.format("two-loop"),
        ),
        "circle": Controller(
            name="circle",
            joint1=Gains.from_milliseconds(k1=8660.0, nu1=0.06911, k2=1.235, nu2=0.0297, k3=0.141),
            joint2=Gains.from_milliseconds(k1=103.7, nu1=0.4938, k2=1.107, nu2=-0.07112, k3=0.1552),
            source=_SOURCE.format("circle"),
        ),
    }
)
