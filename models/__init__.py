"""Robots: data with sources and letters of trust, and the loaders."""
