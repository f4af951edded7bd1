"""Boxes that cover all configurations that reach a pose."""
