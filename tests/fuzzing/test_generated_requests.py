"""Requests that are generated from the OpenAPI document, to every operation of a running
service."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import negative_data_rejection, positive_data_acceptance

from joulepath.app.main import create_app
from joulepath.app.settings import Settings
from tests.app.live import GRACE, Server, serving

MAX_DEADLINE = 0.1
"""Longest deadline [s]: generated requests are valid, and some are hard."""
SHORT = {"max_deadline": MAX_DEADLINE, "max_job_deadline": MAX_DEADLINE}
schema = schemathesis.openapi.from_dict(create_app(Settings(**SHORT)).openapi())


@pytest.fixture(scope="module")
def fuzzed() -> Iterator[Server]:
    with serving(workers=2, queue_size=16, deadline_grace=GRACE, **SHORT) as server:
        yield server


@schema.parametrize()
@settings(
    max_examples=16,
    derandomize=True,
    deadline=None,
    # the examples of the document have a test of their own
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)
def test_holds_for_generated_requests(case: Any, fuzzed: Server) -> None:
    # what the schema allows may still be out of reach (422), and a deadline may pass (504): both
    # are documented
    checks = [positive_data_acceptance, not_a_server_error]
    answer = case.call(base_url=fuzzed.url, timeout=30)
    # schemathesis does not count a body or a head that is too large to be read as a rejection
    too_large = [negative_data_rejection] if answer.status_code in (413, 431) else []
    case.validate_response(answer, excluded_checks=checks + too_large)
    assert answer.status_code != 500, [
        entry for entry in fuzzed.logged() if entry["level"] == "error"
    ]
