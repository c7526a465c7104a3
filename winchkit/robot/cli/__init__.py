"""Commands of robots.

``plan``, ``run`` and ``check`` are the robot's parts of the commands of these names.
"""
