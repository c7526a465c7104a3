"""A process of its own for the instruments on Modbus and serial lines, beside a real-time loop."""
