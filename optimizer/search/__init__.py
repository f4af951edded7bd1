"""Branch and bound over candidates, in stages over one state."""
