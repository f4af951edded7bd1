"""`/studies`: step-by-step improvement of motions, with suggestions."""
