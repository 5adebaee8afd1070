"""Everything SUMO."""
