"""Runs of robots.

``poses`` reads measured poses and samples in motion, ``holds`` finds stretches at rest in a log.
"""
