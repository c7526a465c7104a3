"""Commands on a library of runs: index, list, query; and the diagnosis of a fleet."""
