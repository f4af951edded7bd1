"""An arm's own figures from logs of its motions."""
