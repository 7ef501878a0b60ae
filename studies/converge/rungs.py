"""The ladders of `flexsim converge`: which models at which steps, and what each is held against.

>>> rungs, exact = ladders(Robot(), setting("simulink"))
>>> exact
('assumed-modes:12', 6.25e-05)
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from flexsim.arm.beam import MODES
from flexsim.arm.chain_design import SEGMENTS
from flexsim.loop.settings import Setting
from flexsim.plants.base import Plant
from flexsim.robot import Robot
from studies.converge.rows import MODES_FINE, MODES_OWN, SEGMENTS_OWN, STEPS

Key = tuple[str, float]  # plant, step [s]

REFERENCE = 12  # assumed modes that stand for the exact beam
MODE_RUNGS, SEGMENT_RUNGS = (2, 3, 4, 5, 7, 9, 12), (4, 5, 6, 8, 10, 16)
QUICK_MODES, QUICK_SEGMENTS = (2, 3, 5), (4, 6)
FINER_MODES, FINER_SEGMENTS = 5, 10  # whose steps are looked at, too
FINE = 1.25e-4  # [s] the shortest step of a ladder; the exact beam's is half of it


@dataclass(frozen=True)
class Rung:
    """One model at one step, in a ladder of them from coarse to fine.

    Attributes:
        ladder: in words. plant: name with its size. step: [s]. against: what it is held against.
        default: whether it is what the project takes unless told otherwise.
    """

    ladder: str
    plant: str
    step: float
    against: Key
    default: bool = False

    @property
    def key(self) -> Key:
        """Plant and step."""
        return self.plant, self.step

    @property
    def size(self) -> str:
        """Number of modes or segments."""
        return self.plant.partition(":")[2]


def spoken(key: Key) -> str:
    """Return 'assumed-modes:3 at 1 ms'."""
    return f"{key[0]} at {1e3 * key[1]:g} ms"


def halvings(step: float, last: float) -> Iterator[float]:
    """Give a step and its halves, the last not above a step given [s]."""
    yield step
    while step > last:
        step /= 2
        yield step


def plant_at(robot: Robot, chosen: Setting, key: Key) -> Plant:
    """Return the plant at a step."""
    return robot.plant(key[0], chosen, step=key[1], chain_step=key[1])


def ladders(
    robot: Robot, chosen: Setting, quick: bool = False, part: str = "all"
) -> tuple[list[Rung], Key]:
    """Return all rungs, each ladder from coarse to fine, and what stands for the exact beam.

    A model's own step is 1 ms, halved until its integrator can take it; no ladder has a longer
    one. The exact beam is a rung of its own ladder of steps; of a part, the last of the modes.

    Args:
        part: 'all'; 'sizes', at their own steps; 'defaults', with the exact beam.
    """
    modes, segments = (QUICK_MODES, QUICK_SEGMENTS) if quick else (MODE_RUNGS, SEGMENT_RUNGS)
    beam, chain = f"assumed-modes:{MODES}", f"closed-chain:{SEGMENTS}"
    finer = () if quick else (f"assumed-modes:{FINER_MODES}", f"closed-chain:{FINER_SEGMENTS}")
    beams = [f"assumed-modes:{n}" for n in modes]
    chains = [f"closed-chain:{n}" for n in segments]
    limit = f"assumed-modes:{REFERENCE}"
    names = dict.fromkeys((*beams, *chains, beam, chain, *finer, limit))
    own = {name: robot.plant(name, chosen).step for name in names}
    fine = {name: list(halvings(step, FINE))[-1] for name, step in own.items()}
    exact = limit, fine[limit] / (1 if quick else 2)
    usual = (beam, chain)
    found = [Rung(MODES_OWN, name, own[name], exact, name in usual) for name in beams]
    found += [Rung(MODES_FINE, name, fine[name], exact, name in usual) for name in beams]
    found += [Rung(SEGMENTS_OWN, name, own[name], exact, name in usual) for name in chains]
    for name in (*usual, *finer, limit):
        steps = list(halvings(own[name], exact[1] if name == limit else FINE))
        symbol = "n" if name.startswith("assumed-modes") else "N"
        ladder = f"{STEPS}, {symbol} = {name.partition(':')[2]}"
        found += [
            Rung(ladder, name, step, (name, steps[-1]), name in usual and step == own[name])
            for step in steps
        ]
    if part != "all":
        found = [each for each in found if each.ladder in (MODES_OWN, SEGMENTS_OWN)]
        found = [each for each in found if part == "sizes" or each.default]
        last = sum(each.ladder == MODES_OWN for each in found)
        found.insert(last, Rung(MODES_OWN, *exact, exact))
    return found, exact
