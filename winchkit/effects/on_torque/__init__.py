"""Effects on the motor torque, one per file."""
