"""Excitation trajectories for the identification of the parameters of an arm."""
