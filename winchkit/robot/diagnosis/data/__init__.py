"""Data of a robot's diagnosis: poses at rest, or samples of a trajectory."""
