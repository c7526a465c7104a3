"""Access to single drives of a bench, open or not, and the load of its CAN buses."""
