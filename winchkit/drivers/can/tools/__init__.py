"""Tools on a CAN bus for the user: scan, info, settings, and frames in words.

``scan`` lists nodes, ``info`` describes one, ``config`` saves, compares and writes settings,
``decode`` explains frames.
"""
