"""Tool paths: the shape and course of the TCP, and joint paths along them."""
