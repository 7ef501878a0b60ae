"""Controllers of our own that hold on a bench, `TUNED`, by the trajectory each was tuned for.

    (b1, a1), (b2, a2) = TUNED["circle"].filters(period=1e-3)

Of the paper's structure, (1)-(4) with p = 10 at 1 ms; `source` is the command that found them. The
worst counts of ideal hardware, of one sample of delay added to it, and of a bench with that delay,
torque limits, encoders and noise. The exact linear loop does not grow in any of these, nor with 20
percent more or less of the beam's stiffness, nor with 50 g at the tip. Index (5) with shares for
the torques' total variation and for the v that a hold of 20 s leaves, by CMA-ES: outcomes of a
random search, nothing optimal; for the line the better of seeds 1 and 2. They are from before
searches came to the same on every processor, so that the command ends at others now. Gains are as
the search has them, for time counted in milliseconds (`Gains.from_milliseconds`).
"""

from collections.abc import Mapping
from types import MappingProxyType

from controllers.pid import Controller, Gains

_SOURCE = (
    "flexsim tune --trajectory {} --seed {} --plant assumed-modes assumed-modes:5 "
    "--hardware ideal delayed bench --distribution wide --tuner cma --population 20 "
    "--generations 200 --exact --exact-spread 0.2 --exact-payload 0.05 --effort 3e-8 "
    "--long-hold 20 --residual 0.1"
)

TUNED: Mapping[str, Controller] = MappingProxyType(
    {
        "line": Controller(
            name="line",
            joint1=Gains.from_milliseconds(
                k1=2428.772298922633,
                nu1=0.22127571389967945,
                k2=734.4351240493501,
                nu2=0.2822860330690909,
                k3=-35.42591173904649,
            ),
            joint2=Gains.from_milliseconds(
                k1=45.33275236615981,
                nu1=0.45423181470872653,
                k2=77.81559047086589,
                nu2=0.4304616476010543,
                k3=10.956145019557248,
            ),
            source=_SOURCE.format("line", 2),
        ),
        "two-loop": Controller(
            name="two-loop",
            joint1=Gains.from_milliseconds(
                k1=749.0038400588274,
                nu1=0.1784083709596445,
                k2=-327.77176059029136,
                nu2=0.9184899813079083,
                k3=1469.7899121262249,
            ),
            joint2=Gains.from_milliseconds(
                k1=100.19874819257149,
                nu1=0.4014445415994018,
                k2=20.534960021364142,
                nu2=0.5167597607250162,
                k3=7.88147712853894,
            ),
            source=_SOURCE.format("two-loop", 1),
        ),
        "circle": Controller(
            name="circle",
            joint1=Gains.from_milliseconds(
                k1=212.33830006737352,
                nu1=0.8708523918813111,
                k2=-398.16976653376116,
                nu2=0.9778137982172517,
                k3=1687.5089120505766,
            ),
            joint2=Gains.from_milliseconds(
                k1=98.06244673328986,
                nu1=0.40804270605179543,
                k2=16.250497257853578,
                nu2=0.5737708684028271,
                k3=11.865743659030857,
            ),
            source=_SOURCE.format("circle", 1),
        ),
    }
)
"""One controller per trajectory, each of the form (3), (4)."""
