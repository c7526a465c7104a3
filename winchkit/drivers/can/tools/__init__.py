"""Tools on a CAN bus for the user: scan, info, settings, and frames in words."""
