"""Examples of the routes under /jobs."""

from __future__ import annotations

from joulepath.app.schemas.examples.values import ANSWER_PATH

RESULTS_CSV = (
    "index,name,kind,state,attempt,wall_time_s,energy_J,duration_s,status,answer,problem\n"
    f"0,bin to shelf,optimize,done,1,0.21,57.5,1.33,optimal,{ANSWER_PATH},\n"
    "1,shelf to bin,optimize,failed,1,0.02,,,,,duration-too-short\n"
)
"""Results as CSV."""
RESULTS_LINES = (
    '{"index":0,"name":"bin to shelf","kind":"optimize","state":"done","attempt":1,'
    '"wall_time":0.21,"energy":57.5,"duration":1.33,'
    f'"status":"optimal","answer":"{ANSWER_PATH}","problem":null,"result":{{"robot":"ur5e"}}}}\n'
)
"""Results as lines of JSON; the answer is abridged."""
