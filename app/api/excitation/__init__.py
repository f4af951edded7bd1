"""`POST /excitation`: a motion that tells the parameters of an arm apart."""
