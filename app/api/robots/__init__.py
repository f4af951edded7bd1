"""`/robots`: the arms of the service, and those that users add."""
