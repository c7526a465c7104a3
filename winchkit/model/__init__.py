"""The physics of a winch and its cable, numpy only.

``line`` combines the parts into predictions of a winch; ``sizing`` has the design equations.
"""
