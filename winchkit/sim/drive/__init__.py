"""A simulated CiA 402 servo drive, independent of the driver that it tests."""
