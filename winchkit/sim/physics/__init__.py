"""The simulator's physics, one class per effect, independent of the catalogue of effects."""
