"""Cycles of many stops: which configuration at each, found as a shortest path through proven
bounds.
"""
