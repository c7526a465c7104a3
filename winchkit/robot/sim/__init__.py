"""The simulated robot: one platform on elastic cables that simulated winches wind.

``rotation`` has the attitudes, ``mechanics`` one step of integration, ``platform`` the state,
``cable_end`` the connection to a winch, ``build`` the robot that a file declares, ``tracker`` its
instrument.
"""
