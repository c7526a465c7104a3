"""CANopen services of CiA 301 and CiA 306 that no device profile changes."""
