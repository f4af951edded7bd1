"""What all tasks share: errors become problems, contents become JSON."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import orjson

from app.engine.reply import Reply
from app.exceptions import ServiceError
from app.http.problem_details import problem_reply
from optimizer.exceptions import JoulepathError

logger = logging.getLogger(__name__)


def answer(request_id: str, work: Callable[[], Reply]) -> Reply:
    """What the work returns, or the problem that it raises."""
    try:
        return work()
    except (JoulepathError, ServiceError) as error:
        return problem_reply(error, request_id)
    except Exception as error:
        logger.exception("unforeseen error", extra={"request_id": request_id})
        return problem_reply(error, request_id)


def json_reply(content: dict[str, Any]) -> Reply:
    """An answer as JSON; what is not finite is null."""
    return Reply(200, orjson.dumps(content, option=orjson.OPT_SERIALIZE_NUMPY))
