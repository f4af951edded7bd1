"""`/jobs`: requests computed in the background."""
