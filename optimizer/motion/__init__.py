"""A motion as a function of time: splines, time scalings, quadrature, retiming."""
