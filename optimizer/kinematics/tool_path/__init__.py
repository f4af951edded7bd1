"""Tool paths: their shape over time, and the joints that follow them."""
