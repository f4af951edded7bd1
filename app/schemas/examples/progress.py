"""Example of the progress of a request."""

EVENTS = (
    'event: candidates\ndata: {"total":16}\n\n'
    'event: candidate\ndata: {"index":3,"status":"solved","bound":52.8,"energy":58.1}\n\n'
    'event: incumbent\ndata: {"energy":58.1,"duration":1.31,"bound":52.8,"gap":0.09,'
    '"q_goal":[1.2,-1.1,1.9,-2.2,-1.3,0.4]}\n\n'
    'event: answer\ndata: {"robot":"ur5e"}\n\n'
)
"""Events of a search; the answer is abridged."""
