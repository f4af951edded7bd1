"""JSON documents and schemas of the library's declared answers."""
