"""JSON documents and schemas of the answers that the library declares."""
