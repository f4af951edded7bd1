"""Presentation of the OpenAPI document: tags in the order of the work, pages of the operations, and
groups of the fields of long requests.
"""

from __future__ import annotations

from typing import Any

_TAGS = {
    "robots": ("Robots, tools and figures, including your own.", "robots"),
    "motion": (
        "Motions and cycles of least energy, and energies of given motions.",
        "optimize",
    ),
    "results": ("Programs for controllers, reports and stored answers.", "export"),
    "jobs": ("Many requests that run in the background.", "jobs"),
    "studies": ("Series of experiments on a real arm, with suggestions.", "studies"),
    "logs": ("The figures of your own arm, from its logs.", "identification"),
    "health": ("State and load of the service.", "deployment"),
    "problems": ("Meaning of problem types.", "errors"),
}
"""Text and page of each tag, in the order in which an arm becomes a running program."""
_PAGES = {
    "/compare": "methods",
    "/pareto": "pareto",
    "/cycle": "cycle",
    "/placement": "placement",
    "/whatif": "whatif",
    "/evaluate": "evaluate",
    "/replay": "replay",
    "/ik": "evaluate",
    "/report": "report",
    "/answers": "http",
    "/figures": "identification",
}
"""Pages of paths that have another page than their tag."""
_MOTION = {
    "Task": "start goal path stops order before together closed configurations trajectory log "
    "time_per_segment interpolation parameters period harmonics centre",
    "Arm": "robot figures gravity limits friction drives bus link_mass_scale",
    "Tool and payload": "tcp tool payload",
    "Cell": "scene collisions tool_cone clearance mounting_plane",
    "Time": "duration time dwell hold wait speed_fraction",
    "Configurations": "branch windings",
    "Computation": "objective method methods points bound criterion noise starts deadline",
    "Answer": "candidates answers sample_period",
    "File": "columns units current_units effort",
}
"""Groups of the fields of requests for a motion, with the names of the fields in their order."""
_ARM = {
    "Arm": "name title urdf tip base locked",
    "Shape": "meshes collision srdf",
    "Limits": "payload velocity acceleration jerk torque torque_side",
    "Masses": "masses density mend_inertias",
    "Drives": "drives electronics default_motion",
    "Source": "source trust",
}
"""Groups of the fields of an arm of a user's own."""
_FIGURES = {
    "Arm": "robot title",
    "Identified": "friction_laws drives electronics mains inertials",
    "How well": "covariance session_sd move_sd",
    "As the robot's own": "kinematics limits collision default_motion friction_table",
    "Kept": "id created owner parameters",
}
"""Groups of the fields of a document of figures."""
_LONG = 19
"""Least number of fields of a schema whose fields are grouped."""


def add_pages(document: dict[str, Any]) -> None:
    """Add the tags to a document, and the address of its page to every operation."""
    document["tags"] = [
        {"name": name, "description": text, "externalDocs": _page(page)}
        for name, (text, page) in _TAGS.items()
    ]
    for path, operations in document["paths"].items():
        for operation in operations.values():
            root = f"/{path.split('/')[1]}"
            operation["externalDocs"] = _page(_PAGES.get(root, _TAGS[operation["tags"][0]][1]))


def add_groups(schemas: dict[str, Any]) -> None:
    """Order the fields of long requests by groups; `x-group` names the group of a field."""
    for schema in schemas.values():
        fields = schema.get("properties", {})
        for groups in (_MOTION, _ARM, _FIGURES):
            places = {name: own for own, names in groups.items() for name in names.split()}
            if len(fields) >= _LONG and fields.keys() <= places.keys():
                schema["properties"] = {
                    name: fields[name] | {"x-group": group}
                    for name, group in places.items()
                    if name in fields
                }


def _page(name: str) -> dict[str, str]:
    """Relative: it holds behind a proxy's path, too."""
    return {"description": "Reference", "url": f"help/reference/{name}/"}
