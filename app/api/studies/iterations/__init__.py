"""`/studies/{id}/iterations`: the steps of a study."""
