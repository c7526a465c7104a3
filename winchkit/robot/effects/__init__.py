"""Effects of robots.

``on_robot`` has one effect per file; ``bind`` and ``term`` make terms of the tables of a profile
and apply them, ``reference`` has the poses on which a signature is drawn.
"""
