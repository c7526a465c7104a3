"""Workspace of a robot: where its cables hold and move the platform, and what they come near to.

``circuits`` decides whether cable forces balance wrenches, ``distances`` has those of cables from
each other and from bodies, ``workspace`` both on a grid, ``mesh`` the surface.
"""
