"""The Library view: runs of a folder with their verdicts, and the fleet as a grid.

``view`` has its routes and orders.
"""
