"""`/jobs`: requests that are computed when nobody waits for them."""
