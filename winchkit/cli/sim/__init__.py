"""``winchkit sim`` and ``winchkit demo``: simulated benches and the whole procedure on one."""
