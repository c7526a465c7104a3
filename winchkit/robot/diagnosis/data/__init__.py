"""Data of a robot's diagnosis.

``dataset`` has poses at rest, or samples of a motion with their ``trajectory``.
"""
