"""The service, as the tests of `app` reach it."""

from __future__ import annotations

from tests.app.conftest import _database as _database
from tests.app.conftest import client as client
from tests.app.conftest import server as server
