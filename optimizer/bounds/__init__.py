"""A bound on the energy of a pair that takes the copper loss of holding against gravity into
account.
"""
