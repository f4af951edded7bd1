"""Problems as clients get them, checked against the schemas of their types."""

from __future__ import annotations

import json
from typing import Any

from joulepath.app.http.problems import model_of_problem
from joulepath.optimizer.exceptions import DeclaredError


def checked(kind: type[DeclaredError], content: Any) -> Any:
    """The fields of a document (bytes, text or object), checked against this type of error."""
    document = content if isinstance(content, str | bytes) else json.dumps(content)
    return model_of_problem(kind).model_validate_json(document)
