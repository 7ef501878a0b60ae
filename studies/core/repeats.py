"""Repeats of a run: the same controller with its gains' fourth digits changed, seeded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from controllers import Controller, Gains

PERTURBATION = 1e-4  # relative: the fourth digit of each gain


def perturbed(controller: Controller, count: int, rng: np.random.Generator) -> list[Controller]:
    """Return copies of a controller, every gain changed by a relative PERTURBATION (1 sd)."""

    def shaken(gains: Gains) -> Gains:
        factors = 1 + PERTURBATION * rng.standard_normal(3)
        return replace(
            gains, k1=gains.k1 * factors[0], k2=gains.k2 * factors[1], k3=gains.k3 * factors[2]
        )

    return [
        replace(controller, joint1=shaken(controller.joint1), joint2=shaken(controller.joint2))
        for _ in range(count)
    ]
