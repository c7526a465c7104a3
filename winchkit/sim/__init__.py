"""The simulated bench: a second implementation of the physics, in time steps, and its devices.

It imports declarations only, never the model or the effects, so that finding what it hides
proves something.
"""

from winchkit.sim.bench import choose_bench, choose_hidden

__all__ = ["choose_bench", "choose_hidden"]
