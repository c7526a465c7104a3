"""Pages, figures and texts of robots.

``diagnosis`` and ``calibration`` are whole pages, ``pose_traces`` the data of their figures,
``data`` the tables of the poses; ``notebook`` shows results in consoles and notebooks.
"""
