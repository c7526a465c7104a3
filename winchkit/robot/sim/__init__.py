"""The simulated robot: one platform on elastic cables that simulated winches wind.

It is a second implementation of the mechanics, independent of the model.
"""
