"""Diagnosis of cable robots: effects that are missing from a robot's model, from its poses.

``adjustment`` estimates poses and geometry from ``data`` and ``equations`` (the constraints of
:mod:`winchkit.robot.geometry.constraints`) by the solver of the calibration. There they make the
``regression``, in which ``engine`` selects ``candidates`` with the noise of
``variance_components``. ``errors`` and ``attribution`` describe the residuals; ``pose_design`` and
``plan`` propose poses.
"""
