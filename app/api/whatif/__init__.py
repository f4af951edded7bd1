"""`POST /whatif`: the energy of a motion on a changed arm."""
