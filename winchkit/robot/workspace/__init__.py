"""Workspace of a robot: where its cables hold and move the platform, and what they touch there."""
