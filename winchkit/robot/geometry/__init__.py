"""Geometry of cable robots: cable lengths, and the poses that fit them.

``kinematics`` has the lengths with swivel pulleys, ``constraints`` their derivatives, ``robot`` a
profile's model, ``forward`` and ``pose_estimation`` the pose of lengths, ``tracker`` the instrument
that measures it; ``loops`` are for control.
"""
