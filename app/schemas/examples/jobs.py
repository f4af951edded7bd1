"""Examples of the routes under /jobs."""

from __future__ import annotations

from joulepath.app.schemas.examples.files import Example
from joulepath.app.schemas.examples.values import ANSWER_PATH, EVALUATE, HOME, NEAR

PAYLOAD = {"mass": 2.0, "com": [0.0, 0.0, 0.05]}

NEW_JOB_EXAMPLES: dict[str, Example] = {
    "moves": {
        "summary": "Three moves, and the energy of a given motion",
        "value": {
            "name": "Night run, cell 4",
            "requests": [
                {"optimize": {"start": {"q": HOME}, "goal": {"q": NEAR}}},
                {"optimize": {"start": {"q": NEAR}, "goal": {"q": HOME}, "payload": PAYLOAD}},
                {"optimize": {"start": {"q": HOME}, "goal": {"q": NEAR}, "duration": 0.01}},
                {"evaluate": EVALUATE},
            ],
        },
    }
}

RESULTS_CSV = (
    "index,kind,state,attempt,wall_time_s,energy_J,duration_s,status,answer,problem\n"
    f"0,optimize,done,1,0.21,57.5,1.33,optimal,{ANSWER_PATH},\n"
    "1,optimize,failed,1,0.02,,,,,duration-too-short\n"
)
"""Results as CSV."""
RESULTS_LINES = (
    '{"index":0,"kind":"optimize","state":"done","attempt":1,"wall_time":0.21,"energy":57.5,"duration":1.33,'
    f'"status":"optimal","answer":"{ANSWER_PATH}","problem":null,"result":{{"robot":"ur5e"}}}}\n'
)
"""Results as lines of JSON; the answer is abridged."""
