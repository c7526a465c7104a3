"""Many winches at many dates."""
