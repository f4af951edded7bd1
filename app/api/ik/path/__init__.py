"""`POST /ik/path`: configurations along a path of the TCP."""
