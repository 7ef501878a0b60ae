"""MJCF of other arms than the paper's: one link on a stand, and two links that bend."""
