"""Answers what is no HTTP with a problem, too. uvicorn answers it itself, in plain text, before any application."""

from __future__ import annotations

import uuid

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from app.engine.result import json_document
from app.exceptions import MalformedHttp
from app.http.handlers import PROBLEM_MEDIA_TYPE
from app.http.problem_details import problem_content


class TypedHttpProtocol(HttpToolsProtocol):
    """uvicorn's protocol, whose only answer of its own is a problem."""

    def send_400_response(self, msg: str) -> None:
        """Sends the problem `malformed-http` and closes the connection. `msg` is uvicorn's, for the log."""
        request_id = str(uuid.uuid4())
        body = json_document(problem_content(MalformedHttp(), request_id))
        head = (
            "HTTP/1.1 400 Bad Request\r\n"
            f"content-type: {PROBLEM_MEDIA_TYPE}\r\n"
            f"content-length: {len(body)}\r\n"
            f"x-request-id: {request_id}\r\n"
            "connection: close\r\n\r\n"
        )
        self.transport.write(head.encode() + body)
        self.transport.close()
