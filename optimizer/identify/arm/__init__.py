"""Model of an arm with fitted figures: torques, power, base parameters and pseudo-inertias."""
