"""Logs of one arm: from a file to channels on a uniform grid, cut into moves."""
