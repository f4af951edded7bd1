"""A user's own arm, from a URDF and a short description."""
