"""Given motions: their energy, and the limits that they violate."""
