"""A benchmark: which physical effect does the model of a winch or an axis lack?

Cases are generated from a seed, answers are scored; README.md has the formats. Nothing here imports
winchkit, and the physics is written from textbooks, independently of it.
"""
