"""`POST /cycle`: a cycle of stops with least energy."""
