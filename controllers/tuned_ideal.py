"""Controllers of our own, tuned in the paper's ideal loop: `TUNED_IDEAL`, by trajectory.

    (b1, a1), (b2, a2) = TUNED_IDEAL["circle"].filters(period=1e-3)

Each is the best that the genetic algorithm of section 3.2 found, the worse of the two plants
counting, under the friction `jump`, with (2), p = 10 and a period of 1 ms; `source` is the command,
from before the robot had damping and searches came to the same on every processor. Outcomes of a
random search, the best of seeds 1 to 3: nothing optimal. Gains are as the search has them, drawn
from Table 1 with time counted in milliseconds (`Gains.from_milliseconds`).

They hold without delay only: with one sample of it every one of them grows at 43 1/s or more; those
that hold on a bench are in `controllers.tuned`.

A single run's index is partly luck: where joints stick and slip, the last bit of a tap may move
it by a fifth. `flexsim compare` shows medians over perturbed gains.
"""

from collections.abc import Mapping
from types import MappingProxyType

from controllers.pid import Controller, Gains

_SOURCE = "flexsim tune --trajectory {} --plant both --setting jump --seed 2"

TUNED_IDEAL: Mapping[str, Controller] = MappingProxyType(
    {
        "line": Controller(
            name="ideal-line",
            joint1=Gains.from_milliseconds(
                k1=9417.603258590882,
                nu1=0.40672707687516285,
                k2=1.5695197899633948,
                nu2=-0.18580937642654677,
                k3=-0.04838370124487103,
            ),
            joint2=Gains.from_milliseconds(
                k1=129.83655059369727,
                nu1=0.15772114400349602,
                k2=1.006131586628871,
                nu2=0.055098907217274645,
                k3=0.05263870856726027,
            ),
            source=_SOURCE.format("line"),
        ),
        "two-loop": Controller(
            name="ideal-two-loop",
            joint1=Gains.from_milliseconds(
                k1=12378.95350105369,
                nu1=0.40672707687516285,
                k2=0.9069975462160815,
                nu2=0.06411675034721037,
                k3=-0.022407578120775293,
            ),
            joint2=Gains.from_milliseconds(
                k1=129.83655059369727,
                nu1=0.15772114400349602,
                k2=1.006131586628871,
                nu2=0.053538539196408136,
                k3=-0.1641241567347404,
            ),
            source=_SOURCE.format("two-loop"),
        ),
        "circle": Controller(
            name="ideal-circle",
            joint1=Gains.from_milliseconds(
                k1=12421.64370624384,
                nu1=0.379892247168798,
                k2=0.5438874313335464,
                nu2=-0.010594864325105762,
                k3=-0.19317005163516937,
            ),
            joint2=Gains.from_milliseconds(
                k1=129.83655059369727,
                nu1=0.17440244040252262,
                k2=1.1797260671003114,
                nu2=-0.07772924172821044,
                k3=-0.10291204159143687,
            ),
            source=_SOURCE.format("circle"),
        ),
    }
)
"""One controller per trajectory, each of the form (3), (4)."""
