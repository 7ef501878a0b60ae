"""The comparison of texts by their numbers notices what it should, and only that."""

import pytest
from alike import require_alike


def test_the_last_digit_is_no_difference() -> None:
    require_alike('<joint stiffness="0.123456789012"/>', '<joint stiffness="0.123456789013"/>')
    require_alike("pos 1 0 -1e-17", "pos 1.0 0 0")


@pytest.mark.parametrize(
    ("found", "wanted"),
    [
        ("stiffness 0.123456789", "stiffness 0.123456788"),
        ("stiffness 1", "damping 1"),
        ("pos 1 2", "pos 1 2 3"),
        ("hinge1 of 2", "hinge2 of 2"),
        ("-1", "1"),
    ],
)
def test_anything_else_is_one(found: str, wanted: str) -> None:
    with pytest.raises(AssertionError):
        require_alike(found, wanted)
