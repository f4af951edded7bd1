"""Tool paths: shape and course of the TCP, and joint paths along a tool path."""
