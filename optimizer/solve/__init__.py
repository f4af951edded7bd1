"""Nonlinear programs of motions, their solvers, and the methods that use them."""
