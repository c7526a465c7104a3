"""CANopen services of CiA 301, 305 and 306, independent of the device profile."""
