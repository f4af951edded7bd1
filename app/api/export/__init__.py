"""`POST /export/{format}`: a motion as a program or file for a controller."""
