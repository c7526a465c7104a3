"""winchkit: moves winches, measures tension, and tells which physical effect a model lacks."""

__version__ = "0.1.0"
__all__ = ["__version__"]
