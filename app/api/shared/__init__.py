"""What several routes share: parameters, what the service provides, and how requests are
answered."""
