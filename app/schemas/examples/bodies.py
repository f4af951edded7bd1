"""Examples of request bodies; a file `examples/<endpoint>/<name>.json` holds the same request as
its namesake here.
"""

from __future__ import annotations

from joulepath.app.schemas.examples.figures import FIGURES_EXAMPLES
from joulepath.app.schemas.examples.files import Example, body_examples, shown
from joulepath.app.schemas.examples.identifications import IDENTIFY_EXAMPLES
from joulepath.app.schemas.examples.logs import LOG_EXAMPLES
from joulepath.app.schemas.examples.own_arm import NEW_ROBOT_EXAMPLES, PUT_EXAMPLES
from joulepath.app.schemas.examples.studies import ITERATION_EXAMPLES

JSON = "application/json"
CSV = "text/csv"
BODY_EXAMPLES: dict[str, dict[str, dict[str, Example]]] = {
    **{path: body_examples(path) for path in shown()},
    "/identifications": {JSON: IDENTIFY_EXAMPLES},
    "/logs": {CSV: LOG_EXAMPLES},
    "/robots": {JSON: NEW_ROBOT_EXAMPLES},
    "/robots/{name}": {JSON: PUT_EXAMPLES},
    "/figures": {JSON: FIGURES_EXAMPLES},
    **{
        f"/{kept}/{{id}}": {
            JSON: {"name": {"summary": "Give it a name", "value": {"name": "Night cell"}}},
        }
        for kept in ("answers", "jobs", "studies", "logs", "identifications")
    },
    "/studies/{id}/iterations": {JSON: ITERATION_EXAMPLES},
}
