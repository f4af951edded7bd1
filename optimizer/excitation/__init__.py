"""Excitation trajectories: motions that determine the parameters of an arm."""
