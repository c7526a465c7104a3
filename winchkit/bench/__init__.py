"""A wired bench: its winches, control loop, supervisor, recorder and motion programmes."""
