"""`POST /replay`: a motion in an independent simulator."""
