"""Quality of a fit: intervals of energies, errors on held-out moves, excitation, advice."""
