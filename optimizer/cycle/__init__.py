"""Cycles of many stops: least chains of configurations, with the motions between them."""
