"""A virtual machine whose kernel has CAN interfaces, and what runs in it."""
