"""The Bench view: a bench that the page watches and commands.

:mod:`~winchkit.web.bench.view` has its routes and the one browser that commands,
:mod:`~winchkit.web.bench.browser` the orders of a browser, the other modules what is shown: the
model's prediction and the robot live, frames, objects of the drives, programmes and trips.
"""
