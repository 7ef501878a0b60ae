"""Controllers designed on a linear model of the arm that is handed in, from a few scaled knobs.

    from controllers.model_based import LinearModel, lqg
    A, B, C, D = lqg.design(middle(lqg.KNOBS), model)    # from (e1, e2, v) to two torques

`pd_strain`: PDs and feedback of the beam's deflection; `lqg`: linear quadratic regulator, integral
action and Kalman filter; `mixed_sensitivity`: H-infinity, its order reduced.
"""

from controllers.model_based import lqg, mixed_sensitivity, pd_strain
from controllers.model_based.model import LinearModel, Space, delayed, middle

__all__ = [
    "LinearModel",
    "Space",
    "delayed",
    "lqg",
    "middle",
    "mixed_sensitivity",
    "pd_strain",
]
