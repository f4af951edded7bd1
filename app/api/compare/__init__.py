"""`POST /compare`: the same motion by several methods."""
