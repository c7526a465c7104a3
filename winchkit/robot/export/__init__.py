"""A robot's profile for controllers and simulators: C99, and a model of MuJoCo.

``lines`` makes a winch of each line, ``c_code`` and ``mjcf`` write them with the kinematics of the
robot, ``export`` is the entry.
"""
