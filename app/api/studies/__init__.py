"""`/studies`: motions that are improved step by step, and what is said of them."""
