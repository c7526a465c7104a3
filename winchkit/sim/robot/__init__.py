"""The simulated robot: one platform on elastic cables that simulated winches wind.

``rotation`` and ``pulleys`` are the geometry, ``platform`` the mechanics, ``cable_end`` the
connection to a winch, ``build`` the robot that a file declares, ``tracker`` its instrument.
"""
