"""Middleware, problem details (RFC 9457), the OpenAPI document, and disconnected clients."""
