"""The simulated bench: a second implementation of the physics, in time steps, and its devices.

It imports declarations only and neither the model nor the effects, so that its hidden effects test
the diagnosis independently. ``plant`` and ``physics`` are the mechanics, ``robot`` a platform on
several cables, ``drive`` and ``instruments`` the devices, ``live`` a bench on real buses, ``clock``
simulated time.
"""

from winchkit.sim.bench import choose_bench, choose_hidden

__all__ = ["choose_bench", "choose_hidden"]
