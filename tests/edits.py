"""Edits of models/chain6.xml that a user makes, as models/README.md shows them: texts by name."""

from pathlib import Path

from flexsim import Parameters
from flexsim.arm.chain_design import design_chain
from flexsim.mjcf.chain_xml import chain_mjcf

DEFAULT = (Path(__file__).parents[1] / "models" / "chain6.xml").read_text()


def edited(old: str, new: str, text: str = DEFAULT) -> str:
    """Return the text with one passage replaced, which must be there."""
    assert old in text, old
    return text.replace(old, new)


PAYLOAD = """<site name="tip" pos="0.03469 0 0"/>
                      <body name="payload" pos="0.03469 0 0">
                        <inertial pos="0 0 0" mass="0.05" diaginertia="5e-6 5e-6 5e-6"/>
                      </body>"""

EDITS = {
    "payload": edited('<site name="tip" pos="0.03469 0 0"/>', PAYLOAD),
    "soft hinge": edited('stiffness="3.45787937081"', 'stiffness="1.7289396854"'),
    "damped": chain_mjcf(Parameters(zeta=0.01), design_chain(Parameters(), 6), timestep=5e-4),
    "longer": chain_mjcf(Parameters(L=0.6), design_chain(Parameters(L=0.6), 6)),
    "heavy link": edited('diaginertia="0.25 0.25 0.25"', 'diaginertia="0.5 0.5 0.5"'),
    "4 segments": chain_mjcf(Parameters(), design_chain(Parameters(), 4)),
    "16 segments": chain_mjcf(Parameters(), design_chain(Parameters(), 16), timestep=1e-4),
}
