"""How far a robot's parameters can be trusted: the meaning of the trust letters, and a sentence on its energies."""

from __future__ import annotations

from typing import Any

TRUST = {
    "A": "maker's own file or data packet",
    "B": "fitted to measured data",
    "C": "value from a paper, quoted second-hand",
    "T": "transferred from a sister robot",
    "E": "engineering default, no source",
}
# sections of a robot's figures that its energies depend on
ENERGY_SECTIONS = ("inertials", "friction_laws", "drives", "electronics")
# what an energy depends on: section and figure, and its name in the sentence. Friction is its default law's
_ENERGY_FIGURES = {
    ("inertials", "mass"): "link masses",
    ("inertials", "inertia"): "link inertias",
    ("drives", "torque_constant"): "torque constants",
    ("drives", "rotor_inertia"): "rotor inertias",
    ("friction_laws", ""): "friction",
    ("drives", "copper"): "copper loss",
    ("drives", "inverter_constant"): "inverter loss",
    ("electronics", "idle_power"): "idle power",
    ("electronics", "regeneration"): "regeneration",
    ("limits", "acceleration"): "acceleration limits",
    ("limits", "jerk"): "jerk limits",
}
_GROUPS = {
    "A": "the maker's own figures",
    "B": "figures fitted to measured data",
    "C": "second-hand figures from papers",
    "T": "figures transferred from a sister robot",
    "E": "engineering defaults without a source",
}


def energy_trust(figures: dict[str, Any]) -> str:
    """One sentence on what the energies of a robot rest on, from the trust letters of its figures."""
    by_letter: dict[str, list[str]] = {letter: [] for letter in _GROUPS}
    for (section, name), words in _ENERGY_FIGURES.items():
        found = figures[section]
        by_letter[worst_letter(next(iter(found.values())) if section == "friction_laws" else found[name])].append(words)
    groups = [f"{_GROUPS[letter]} ({', '.join(names)})" for letter, names in by_letter.items() if names]
    *first, last = groups
    return f"Energies rest on {', '.join(first)} and {last}." if first else f"Energies rest on {last}."


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
