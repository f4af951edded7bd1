"""`POST /ik`: every arm configuration that reaches a pose."""
