"""`curl -d @examples/optimize/….json` declares its body a form: the service takes it for the JSON
that it is.
"""

from __future__ import annotations

import pytest
from fastapi.testclient import TestClient

BODY = '{"start": {"q": [0, -1, 1, 0, 1, 0]}, "goal": {"q": [0.1, -1, 1, 0, 1, 0]}}'


@pytest.mark.parametrize(
    "declared", ["application/x-www-form-urlencoded", "application/json", None]
)
def test_json_is_taken_however_it_is_declared(client: TestClient, declared: str | None) -> None:
    headers = {} if declared is None else {"content-type": declared}
    answer = client.post("/optimize", content=BODY, headers=headers)
    assert answer.status_code == 200
    assert answer.json()["branch"]["goal"]["q"][0] == pytest.approx(0.1)


def test_a_form_is_refused(client: TestClient) -> None:
    answer = client.post("/optimize", data={"start": "home", "goal": "away"})
    assert answer.status_code == 422
    assert answer.json()["type"] == "/problems/invalid-request"
