"""What fuzz_parsers.py feeds, and with what."""
