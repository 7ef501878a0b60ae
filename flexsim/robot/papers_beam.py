"""The paper's beam on a file's rigid bodies: `--beam analytic`.

>>> with_papers_beam(parameters_of(chain), chain).EI
0.349
"""

from __future__ import annotations

from dataclasses import replace

from flexsim.arm.parameters import Parameters
from flexsim.errors import ModelError
from flexsim.mjcf.bodies import parts, payload_ahead
from flexsim.mjcf.chain_file import ChainModel
from flexsim.mjcf.reading.linear_checks import require_linear
from flexsim.mjcf.rod_file import RodModel

SAME_LENGTH = 1e-6  # relative
BALANCED = 1e-9  # [kg m] of the hub about joint 2
AT_TIP = 1e-4  # of the beam, within which the centre of a payload is at its tip


def with_papers_beam(own: Parameters, arm: ChainModel | RodModel | None) -> Parameters:
    """Return the robot of a file with the paper's beam, as long as the file's.

    Damping ratio and payload stay the file's.

    Args:
        own: the robot as its file has it. arm: that file.

    Raises:
        ModelError: the file has something that no analytic beam takes along.
    """
    paper = Parameters()
    if arm is not None:
        if abs(own.L / paper.L - 1) > SAME_LENGTH:
            raise ModelError(
                f"{arm.source}: its beam is {own.L:g} m long, the paper's {paper.L:g} m; "
                "--beam analytic is for files with the paper's length"
            )
        require_linear(arm)
    if isinstance(arm, ChainModel):
        hub = parts(arm)[1]
        if abs(float(hub.mass @ hub.x)) > BALANCED:
            raise ModelError(
                f"{arm.source}: body 'hub' has its centre of mass beside joint2, which --beam "
                "analytic cannot carry; leave it out, or centre the hub"
            )
        ahead = payload_ahead(arm)
        if abs(ahead) > AT_TIP * own.L:
            raise ModelError(
                f"{arm.source}: body 'payload' has its centre of mass {ahead:g} m ahead of the "
                "tip, which --beam analytic cannot carry; leave it out, or move it"
            )
    return replace(own, L=paper.L, rho=paper.rho, EI=paper.EI)
