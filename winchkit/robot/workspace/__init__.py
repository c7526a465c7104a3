"""Workspace of a robot: where its cables hold and move the platform, and what they come near to.

:func:`~winchkit.robot.workspace.workspace.workspace_of` is the entry.
"""
