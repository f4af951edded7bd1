"""Trust letters of a robot's parameters, and one sentence on the trust in its energies."""

from __future__ import annotations

from typing import Any

TRUST = {
    "A": "published by the manufacturer",
    "B": "fitted to measured data",
    "C": "from a paper or a third party's file, second-hand",
    "T": "transferred from a sister robot",
    "E": "engineering default without a source",
}
# sections of figures with an influence on energies
ENERGY_SECTIONS = ("inertials", "friction_laws", "drives", "electronics")
_GROUPS = {
    "A": "the manufacturer's figures",
    "B": "figures fitted to measured data",
    "C": "second-hand figures",
    "T": "figures transferred from a sister robot",
    "E": "engineering defaults without a source",
}


def energy_trust(figures: dict[str, Any]) -> str:
    """One sentence on the figures behind the energies of a robot, by their trust letters."""
    groups = [
        f"{_GROUPS[letter]} ({', '.join(names)})"
        for letter, names in figures_by_letter(figures).items()
    ]
    *first, last = groups
    return f"Energies are based on {' and '.join([', '.join(first), last] if first else [last])}."


def figures_by_letter(figures: dict[str, Any]) -> dict[str, list[str]]:
    """Phrases for the figures behind an energy, by their trust letters, best letter first."""
    by_letter: dict[str, list[str]] = {letter: [] for letter in _GROUPS}
    for words, section in _energy_figures(figures).items():
        by_letter[worst_letter(section)].append(words)
    return {letter: names for letter, names in by_letter.items() if names}


def _energy_figures(figures: dict[str, Any]) -> dict[str, Any]:
    """Figures behind an energy by phrases for them; the friction is the default law's."""
    inertials, drives, electronics = (
        figures[section] for section in ("inertials", "drives", "electronics")
    )
    return {
        "link masses": inertials["mass"],
        "centres of mass": inertials["center_of_mass"],
        "link inertias": {part: inertials[part] for part in ("inertia", "inertia_frame_rpy")},
        "torque constants": drives["torque_constant"],
        "rotor inertias": drives["rotor_inertia"],
        "friction": next(iter(figures["friction_laws"].values())),
        "copper loss": drives["copper"],
        "inverter loss": {
            part: figure for part, figure in drives.items() if part.startswith("inverter")
        },
        "idle power": electronics["idle_power"],
        "regeneration": electronics["regeneration"],
        "acceleration limits": figures["limits"]["acceleration"],
        "jerk limits": figures["limits"]["jerk"],
    }


def worst_letter(section: Any) -> str:
    """The last trust letter, in the order of TRUST, of a figure or of all figures in a section."""
    return max(trust_letters(section), key=list(TRUST).index)


def trust_letters(section: Any) -> set[str]:
    """The trust letters of a figure, or of all figures in a section."""
    if not isinstance(section, dict):
        return set()
    if "trust" in section:
        return {str(section["trust"])}
    return set().union(*map(trust_letters, section.values()))
