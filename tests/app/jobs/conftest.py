"""A service whose dispatcher ends with its test."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from joulepath.app.store.store import Store
from tests.app.jobs.test_dispatcher import Service


@pytest.fixture
async def service(store: Store) -> AsyncIterator[Service]:
    service = Service("only", store)
    yield service
    await service.dispatcher.stop()
