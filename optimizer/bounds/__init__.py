"""Proven lower bounds on the energy of a motion."""
