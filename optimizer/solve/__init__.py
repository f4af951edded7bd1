"""Nonlinear programs of motions, their solvers, and the methods based on the solvers."""
