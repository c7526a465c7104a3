"""Effects on the way from rope force to motor torque, one a file."""
