"""`/robots`: the bundled robots and the robots added by users."""
