"""Solvers: the nonlinear programs, and the methods that pose them."""
