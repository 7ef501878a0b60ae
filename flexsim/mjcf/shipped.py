"""Where are the models that come with flexsim? Beside the packages: in the tree, in a wheel.

>>> model_path("chain6.xml").name
'chain6.xml'
"""

from __future__ import annotations

from pathlib import Path

from flexsim.errors import ModelError

MODELS = Path(__file__).parents[2] / "models"


def model_path(name: str) -> Path:
    """Return the path of a model that comes with flexsim, by its file's name.

    Raises:
        ModelError: there is none such; the message names those that there are.
    """
    path = MODELS / name
    if path.parent != MODELS or path.suffix != ".xml" or not path.is_file():
        found = ", ".join(sorted(path.name for path in MODELS.glob("*.xml")))
        raise ModelError(f"there is no model {name!r}; choose one of {found or '(none installed)'}")
    return path
