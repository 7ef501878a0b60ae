"""Completion."""
from dataclasses import dataclass
@dataclass(frozen=True)
class CompletionConfig:
    """Completion."""
def command(config): ...
