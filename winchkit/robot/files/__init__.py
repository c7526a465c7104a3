"""Runs of robots: measured poses, and the holds of a log."""
