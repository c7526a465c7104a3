"""Diagnosis of cable robots: effects that are missing from a robot's model, from its poses.

``dataset`` and ``equations`` (the constraints of :mod:`winchkit.model.robot.constraints`) make the
``regression``, in which ``engine`` selects ``candidates`` with the noise of
``variance_components``. ``errors`` and ``attribution`` describe the residuals; ``pose_design`` and
``plan`` propose poses.
"""
