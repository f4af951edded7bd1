"""Cycles of many stops: least chains of configurations with motions between the stops."""
