"""Dynamics of cable robots, and what control computes each cycle.

``dynamics`` and ``integration`` have the motion of the platform, ``cycle``, ``dynamics_cycle`` and
``elongation_correction`` one pose at a time, with the loops of ``kernels``.
"""
