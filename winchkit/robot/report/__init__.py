"""Pages, figures and texts of robots.

``diagnosis`` and ``calibration`` are whole pages; ``notebook`` registers renderers.
"""
