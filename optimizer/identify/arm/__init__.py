"""An arm with fitted figures: what its torques and its power are made of."""
