"""Diagnosis of robots: poses in place of time, the same search for what is missing."""
