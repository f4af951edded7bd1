"""`POST /evaluate`: the energy of a given motion."""
