"""Work cycles of many stops: the configuration at each stop, by a shortest path."""
