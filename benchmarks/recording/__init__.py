"""What the benchmarks of the recorder have in common."""
