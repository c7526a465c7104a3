"""Forces of cable robots.

``balance`` and ``force_distribution`` have the cable forces that hold a wrench, ``elongation`` the
forces of stretched cables.
"""
