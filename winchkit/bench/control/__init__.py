"""The control loop of a bench: motion, supervision and stops, in one cycle after the other."""
