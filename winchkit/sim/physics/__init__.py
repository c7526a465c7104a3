"""The simulator's own physics, one small class a phenomenon, written without the catalogue."""
