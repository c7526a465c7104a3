"""Tools on a CAN bus for people: scan, info, settings, and frames in words."""
