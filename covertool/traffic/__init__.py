"""Everything SUMO: nets, demand, the child process that drives, and the traces of its cars."""
