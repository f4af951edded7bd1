"""`POST /ik`: all arm configurations of a pose."""
