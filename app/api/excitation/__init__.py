"""`POST /excitation`: a motion for the identification of an arm."""
