"""An open bench: winches, control loop, supervision, logs, and motion programmes."""
