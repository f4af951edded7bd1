"""Clients: authentication, roles and owners."""
