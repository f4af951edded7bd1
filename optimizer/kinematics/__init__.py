"""Positions of a serial chain, and every inverse; the only room that knows the form of an arm."""
