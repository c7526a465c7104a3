"""Calibration of cable robots: geometry and winches from poses of which anything was measured.

``calibrate`` fits ``parameters`` in ``equations`` (the constraints of
:mod:`winchkit.robot.geometry.constraints`) by
:mod:`winchkit.robot.identification.bundle_adjustment`, alternating with
``variance_components``. ``identifiability``, ``outliers``, ``candidate_effects`` and ``prediction``
judge the fit; ``pose_design`` proposes poses; ``results`` and ``profile`` write it.
"""
