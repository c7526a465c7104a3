"""Commands that compare a model with runs: compare, diagnose, add, plan, calibrate, size."""
