"""Rows for the fits: averaged samples of logs, their moves and motions, clusters and splits."""
