"""Near rest: linearisation, poles, growth, margins of the sampled loop."""
