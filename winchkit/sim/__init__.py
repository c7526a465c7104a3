"""The simulated bench: a second implementation of the physics, in time steps, and its devices.

It imports declarations only and neither the model nor the effects, so that its hidden effects test
the diagnosis independently.
"""

from winchkit.sim.bench import choose_bench, choose_hidden

__all__ = ["choose_bench", "choose_hidden"]
