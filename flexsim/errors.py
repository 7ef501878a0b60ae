"""What can go wrong, as one family: catch `FlexsimError` to catch everything we raise."""


class FlexsimError(Exception):
    """Base of every error that this project raises on purpose."""


class ParameterError(FlexsimError, ValueError):
    """A number, name or option that cannot be used."""


class ModelError(FlexsimError, ValueError):
    """An MJCF file that is not the two-link arm the chain plant expects."""


class RunError(FlexsimError, OSError):
    """A file or folder that cannot be read or written."""


class DivergenceError(FlexsimError, RuntimeError):
    """A motion that left the workspace or became non-finite where it must not."""
