"""How well a robot's figures are known: the document of those identified on one arm, and what their
errors may be.
"""
