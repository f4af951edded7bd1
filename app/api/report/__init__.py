"""`/report`: one page on a motion or a cycle, as HTML or PDF."""
