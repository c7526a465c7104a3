"""One drive's objects and the load of its bus, beside a running bench or without one."""
