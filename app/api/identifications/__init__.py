"""`/identifications`: figures of one arm, found from its logs."""
