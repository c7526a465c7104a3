"""The simulated mechanics: drum, cable, pulleys, load, servo loops and sensors, over time.

:class:`~winchkit.sim.plant.plant.WinchPlant` integrates them; it shares no code with the model.
"""
