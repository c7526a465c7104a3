"""Forward dynamics: the motion of a profile under a torque or a reference, and its formulas.

``tracing`` turns the line and the effects of a profile into expressions (``expression``),
``balance`` solves them for the acceleration, ``integration`` integrates it with events under one of
the ``drives``. The package imports nothing of the simulated
benches.
"""
