"""`/figures`: figures identified on one arm."""
