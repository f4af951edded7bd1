"""Quality of a fit: intervals, errors on held-out moves, excitation, advice."""
