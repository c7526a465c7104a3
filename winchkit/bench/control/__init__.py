"""The control loop of a bench: motion, supervision, stops, and the latch."""
