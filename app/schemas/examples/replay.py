"""Examples of POST /replay. A client can send the id of a kept answer, too."""

from __future__ import annotations

from typing import Any

from joulepath.app.schemas.examples.export import ANSWER
from joulepath.app.schemas.examples.files import Example

_ENERGY: dict[str, Any] = {"electrical": {"total": 70.40564079868456}, "mechanical": {"total": 11.614725877535061}}

REPLAY_EXAMPLES: dict[str, Example] = {
    "more_friction": {
        "summary": "A motion with a payload, and with more and less friction",
        "description": "What a replay looks at of an answer of `POST /optimize`. Without baselines, no savings are "
        "replayed.",
        "value": {"answer": {**ANSWER, "energy": _ENERGY}, "control": "feed_forward", "perturb": {"friction": 0.3}},
    },
}
