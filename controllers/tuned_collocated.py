"""PIDs that ignore v, for both joints, that hold on a bench: `COLLOCATED`.

    (b1, a1), (b2, a2) = COLLOCATED.filters(period=1e-3)      # in a loop whose v_gain is 0

Each joint is controlled on its own angle, where its motor is. Found by the search that found
`controllers.tuned`, with as many individuals, for the two-loop; joint 1's gains are 0.8 times what
it found, so that on each path of the paper's figures both torques together vary less in all than
those of `TUNED`, and are no larger in rms together but for two per cent (joint 2's alone is). It
serves every trajectory. An outcome of a random search, nothing optimal.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from controllers.pid import textbook_pid
from controllers.series import Filter


@dataclass(frozen=True)
class TextbookPid:
    """Textbook PIDs of both joints; see `controllers.textbook_pid`.

    Attributes:
        joint1, joint2: kp [N m/rad], ki [N m/(rad s)], kd [N m s/rad].
        filter_time: of both derivatives [s]. v_gain: factor of atan(v/(r+L)) in their loop.
        name, source: as of a `Controller`.
    """

    name: str
    joint1: tuple[float, float, float]
    joint2: tuple[float, float, float]
    filter_time: float
    source: str
    v_gain: float = 0.0

    def filters(self, period: float) -> tuple[Filter, Filter]:
        """Return the filters ((b1, a1), (b2, a2)) at a sampling period [s].

        Raises:
            ControllerError: a number out of range.
        """
        return (
            textbook_pid(*self.joint1, period, self.filter_time),
            textbook_pid(*self.joint2, period, self.filter_time),
        )

    def scaled(self, factors: Sequence[float]) -> "TextbookPid":
        """Return the same with kd, ki, kp of joint 1, then of joint 2, times factors (6,)."""
        (d1, i1, p1, d2, i2, p2) = factors
        (kp1, ki1, kd1), (kp2, ki2, kd2) = self.joint1, self.joint2
        return replace(
            self, joint1=(p1 * kp1, i1 * ki1, d1 * kd1), joint2=(p2 * kp2, i2 * ki2, d2 * kd2)
        )


COLLOCATED = TextbookPid(
    name="collocated",
    joint1=(1646.8533690169152, 34.41175152970724, 7.1575767434759285),
    joint2=(41.60987624689034, 0.3588541854043878, 0.32665754951028936),
    filter_time=0.003,
    source=(
        "flexsim tune --trajectory two-loop --seed 1 --plant assumed-modes assumed-modes:5 "
        "--controller pid --realisation textbook --filter-time 0.003 --v-gain 0 "
        "--hardware ideal delayed bench --distribution log-uniform --tuner cma --population 20 "
        "--generations 200 --exact --exact-spread 0.2 --exact-payload 0.05 --effort 3e-8 "
        "--long-hold 20 --residual 0.1"
    ),
)
"""PIDs for every trajectory, v ignored."""
