"""Random numbers that depend on what they are for, not on what was drawn before: counted noise.

    >>> normal(seed=1, run=0, sample=17)      # the same wherever, whenever and on whatever thread

Philox4x32-10: ten rounds turn a counter and a key into four random words. Products of 32-bit words
are taken in 64 bits, of which the compiler's wrap and Python's do not; masks give both alike.

Source: J. K. Salmon et al., Parallel random numbers: as easy as 1, 2, 3, SC11 (2011).
"""

from __future__ import annotations

import math

from flexsim.numerics.jit import jit

MASK = 0xFFFFFFFF  # of a 32-bit word
ROUNDS = 10
MULTIPLIERS = 0xD2511F53, 0xCD9E8D57
WEYL = 0x9E3779B9, 0xBB67AE85  # what the key grows by in each round
WORD = 2.0**-32
SEED_MOST = 2**63 - 1  # a key has 64 bits, a compiled integer one sign


@jit
def philox(c0: int, c1: int, c2: int, c3: int, k0: int, k1: int):  # type: ignore[no-untyped-def]
    """Return four random words of 32 bits, of a counter of four words and a key of two."""
    m0, m1 = MULTIPLIERS
    w0, w1 = WEYL
    for _ in range(ROUNDS):
        p0, p1 = m0 * c0, m1 * c2
        high0, low0 = (p0 >> 32) & MASK, p0 & MASK
        high1, low1 = (p1 >> 32) & MASK, p1 & MASK
        c0, c1, c2, c3 = high1 ^ c1 ^ k0, low1, high0 ^ c3 ^ k1, low0
        k0, k1 = (k0 + w0) & MASK, (k1 + w1) & MASK
    return c0, c1, c2, c3


@jit
def normal(seed: int, run: int, sample: int, channel: int = 0) -> float:
    """Return a number of the standard normal distribution, by Box and Muller; at most 6.8 large.

    Args:
        seed: 0 to SEED_MOST. run, sample: 0 to 2^32 - 1. channel: which of what one sample reads.
    """
    words = philox(sample, run, channel, 0, seed & MASK, (seed >> 32) & MASK)
    first, second = words[0], words[1]
    radius = math.sqrt(-2.0 * math.log((first + 0.5) * WORD))
    return radius * math.cos(2.0 * math.pi * second * WORD)
