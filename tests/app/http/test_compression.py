"""Answers by `Accept-Encoding`, and bodies by `Content-Encoding`, over a real socket."""

from __future__ import annotations

import asyncio
import gzip
import http.client
import json
import zlib
from typing import Any

import pytest
import zstandard
from starlette.responses import Response, StreamingResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from joulepath.app.access.client import Client
from joulepath.app.exceptions.base import InvalidRequest
from joulepath.app.exceptions.transport import BodyTooLarge, NotAcceptable, UnsupportedCoding
from joulepath.app.http.bodies import Bodies
from joulepath.app.http.compression import Compression
from joulepath.app.http.transfers import Transfers
from joulepath.app.settings import Settings
from tests.app.live import ANSWER, Server
from tests.app.problems import checked
from tests.app.requests import move

POSE = {"pose": {"position": [0.4, -0.2, 0.3], "quaternion": [0.0, 1.0, 0.0, 0.0]}}


def sent(
    server: Server, path: str, body: bytes | None, **headers: str
) -> tuple[http.client.HTTPResponse, bytes]:
    """The answer with its bytes from the wire, not unpacked by a client."""
    connection = http.client.HTTPConnection(server.url.removeprefix("http://"), timeout=ANSWER)
    connection.putrequest("GET" if body is None else "POST", path, skip_accept_encoding=True)
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    if body is not None:
        given = {"Content-Type": "application/json", "Content-Length": str(len(body)), **given}
    for name, value in given.items():
        connection.putheader(name, value)
    connection.endheaders(body)
    answer = connection.getresponse()
    content = answer.read()
    connection.close()
    return answer, content


@pytest.mark.parametrize(
    ("header", "coding"),
    [
        ("", "identity"),
        ("gzip", "gzip"),
        ("x-gzip", "gzip"),
        ("GZIP", "gzip"),
        ("gzip, deflate, br, zstd", "zstd"),
        ("zstd;q=0.5, gzip;q=0.8", "gzip"),
        ("zstd;q=0, gzip", "gzip"),
        ("*", "zstd"),
        ("*;q=0.1, identity", "identity"),
        ("br", "identity"),
        ("gzip;q=0", "identity"),
        ("*;q=0, gzip;q=0.001", "gzip"),
        ("identity;q=0", None),
        ("*;q=0", None),
        ("br, identity;q=0", None),
        ("identity;q=0, *", "zstd"),
        ("*;q=0, identity", "identity"),
        ("gzip;q=nan, zstd;q=2, gzip ;q= 1", "gzip"),
        (",,;;,", "identity"),
        ("gzip;q=", "identity"),
        ("gzip;level=9;q=0.4, identity;q=0.5", "identity"),
    ],
)
def test_the_coding_of_greatest_weight(header: str, coding: str | None) -> None:
    if coding is None:
        with pytest.raises(NotAcceptable):
            Compression().preferred(header)
    else:
        assert Compression().preferred(header) == coding


def unpacked(coding: str | None, content: bytes) -> bytes:
    if coding == "zstd":
        return zstandard.ZstdDecompressor().decompress(content)
    return gzip.decompress(content) if coding == "gzip" else content


@pytest.mark.parametrize(
    ("header", "coding"), [("gzip", "gzip"), ("zstd", "zstd"), ("identity", None)]
)
def test_answers_are_the_same_in_every_coding(
    server: Server, header: str, coding: str | None
) -> None:
    plain, expected = sent(server, "/robots/ur5e", None)
    answer, content = sent(server, "/robots/ur5e", None, Accept_Encoding=header)
    assert (plain.status, plain.getheader("content-encoding")) == (200, None)
    assert answer.getheader("content-encoding") == coding
    assert "accept-encoding" in (answer.getheader("vary") or "").lower()
    assert "accept-encoding" in (plain.getheader("vary") or "").lower()
    assert int(answer.getheader("content-length") or 0) == len(content)
    assert unpacked(coding, content) == expected
    assert coding is None or len(content) < len(expected) / 3


def test_a_coding_that_nobody_has_is_refused_before_any_work(server: Server) -> None:
    answer, content = sent(
        server, "/optimize", json.dumps(move()).encode(), Accept_Encoding="br, identity;q=0"
    )
    assert answer.status == 406
    checked(NotAcceptable, content)


def test_small_answers_stay_as_they_are(server: Server) -> None:
    answer, content = sent(server, "/healthz", None, Accept_Encoding="gzip")
    assert answer.getheader("content-encoding") is None
    assert json.loads(content) == {"status": "alive"}


def transfers(app: ASGIApp) -> ASGIApp:
    """The middleware around an application, for requests without a key."""

    async def with_client(scope: Scope, receive: Receive, send: Send) -> None:
        given = {
            "method": "POST",
            "path": "/ik",
            "query_string": b"",
            "state": {"client": Client("127.0.0.1")},
        }
        await Transfers(app, Bodies(Settings()), None)({**scope, **given}, receive, send)

    return with_client


def through(response: Response, header: str = "gzip") -> list[Message]:
    """The messages of a response behind the middleware."""
    messages: list[Message] = []

    async def send(message: Message) -> None:
        messages.append(message)

    async def receive() -> Message:
        return {"type": "http.disconnect"}

    asyncio.run(
        transfers(response)(
            {"type": "http", "headers": [(b"accept-encoding", header.encode())]}, receive, send
        )
    )
    return messages


def headers_of(messages: list[Message]) -> dict[bytes, bytes]:
    return dict(messages[0]["headers"])


def test_streams_pass_piece_by_piece() -> None:
    async def events() -> Any:
        for k in range(3):
            yield f"data: {k}\n\n" * 1000

    for kind in ("text/event-stream", "application/x-ndjson", "text/csv"):
        messages = through(StreamingResponse(events(), media_type=kind))
        assert b"content-encoding" not in headers_of(messages)
        assert [len(message["body"]) for message in messages[1:]] == [
            len("data: 0\n\n" * 1000)
        ] * 3 + [0]


def test_a_strong_etag_becomes_weak_and_a_packed_body_is_left_alone() -> None:
    text = b"x" * 5000
    messages = through(
        Response(text, media_type="text/plain", headers={"ETag": '"1"', "Vary": "Origin"})
    )
    assert headers_of(messages)[b"etag"] == b'W/"1"'
    assert headers_of(messages)[b"vary"].lower() == b"origin, accept-encoding"
    packed = through(Response(text, media_type="text/plain", headers={"Content-Encoding": "br"}))
    assert packed[1]["body"] == text and headers_of(packed)[b"content-encoding"] == b"br"
    assert through(Response(text, media_type="image/png"))[1]["body"] == text


@pytest.mark.parametrize(
    ("coding", "pack"),
    [
        ("gzip", gzip.compress),
        ("x-gzip", gzip.compress),
        ("deflate", zlib.compress),
        ("identity", bytes),
        ("zstd", zstandard.compress),
        ("zstd", lambda body: zstandard.compress(body[:7]) + zstandard.compress(body[7:])),
        ("GZip", lambda body: gzip.compress(body[:7]) + gzip.compress(body[7:])),
    ],
)
@pytest.mark.parametrize("path", ["/ik", "/evaluate"])
def test_packed_bodies_are_taken(server: Server, coding: str, pack: Any, path: str) -> None:
    body = (
        POSE
        if path == "/ik"
        else {"configurations": [[0.0] * 6, [0.1] * 6], "time_per_segment": 1.0}
    )
    answer, content = sent(server, path, pack(json.dumps(body).encode()), Content_Encoding=coding)
    assert answer.status == 200, content


@pytest.mark.parametrize("coding", ["br", "zstd, zstd", "gzip, gzip", "compress", "x" * 100])
def test_other_codings_are_told_so(server: Server, coding: str) -> None:
    answer, content = sent(server, "/ik", b"{}", Content_Encoding=coding)
    assert answer.status == 415
    checked(UnsupportedCoding, content)


WHOLE = gzip.compress(json.dumps(POSE).encode(), mtime=0)
WHOLE_ZSTD = zstandard.ZstdCompressor(write_checksum=True).compress(json.dumps(POSE).encode())
# a frame with a window of 128 MiB
LARGE_WINDOW = b"\x28\xb5\x2f\xfd\x00\x88" + b"\x01\x00\x00"


@pytest.mark.parametrize(
    ("coding", "body"),
    [
        *(
            (coding, body)
            for coding, whole in (("gzip", WHOLE), ("zstd", WHOLE_ZSTD))
            for body in (
                whole[:-1],
                whole[:20],
                b"",
                b"{}",
                whole + b"more",
                whole[:-4] + b"\0" * 4,
            )
        ),
        ("zstd", WHOLE),
        ("zstd", LARGE_WINDOW),
    ],
    ids=range(14),
)
def test_damaged_bodies_are_told_so(server: Server, coding: str, body: bytes) -> None:
    answer, content = sent(server, "/ik", body, Content_Encoding=coding)
    assert answer.status == 422
    assert checked(InvalidRequest, content).errors[0].loc == ["body"]


PACKS: dict[str, Any] = {"gzip": gzip.compress, "zstd": zstandard.compress}


@pytest.mark.parametrize(
    ("path", "coding"), [("/ik", "gzip"), ("/evaluate", "zstd"), ("/whatif", "gzip")]
)
def test_a_bomb_is_refused(server: Server, path: str, coding: str) -> None:
    # at most a hundred kilobytes, unpacked to more than the limit of any path
    bomb = PACKS[coding](b" " * 80_000_000)
    answer, content = sent(server, path, bomb, Content_Encoding=coding)
    assert answer.status == 413
    checked(BodyTooLarge, content)


@pytest.mark.parametrize("coding", PACKS)
def test_a_bomb_is_never_whole_in_memory(coding: str) -> None:
    bomb = PACKS[coding](b"\0" * 50_000_000)
    pieces: list[int] = []

    class Enough(Exception):
        pass

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        while sum(pieces) < 1_000_000:
            pieces.append(len((await receive())["body"]))
        raise Enough

    async def receive() -> Message:
        return {"type": "http.request", "body": bomb, "more_body": False}

    async def send(_: Message) -> None: ...

    scope = {
        "type": "http",
        "headers": [(b"content-encoding", coding.encode()), (b"content-length", b"7")],
    }
    with pytest.raises(Enough):
        asyncio.run(transfers(app)(scope, receive, send))
    assert max(pieces) <= 5_000_000


@pytest.mark.parametrize(("coding", "whole"), [("gzip", WHOLE), ("zstd", WHOLE_ZSTD)])
def test_the_messages_of_an_unpacked_body_end(coding: str, whole: bytes) -> None:
    """Routes wait for the end of the connection after the body, so its message must reach them."""
    arriving: list[Message] = [
        {"type": "http.request", "body": whole[k : k + 1], "more_body": True}
        for k in range(len(whole))
    ]
    arriving += [
        {"type": "http.request", "body": b"", "more_body": False},
        {"type": "http.disconnect"},
    ]
    seen: list[Message] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        while not seen or seen[-1]["type"] != "http.disconnect":
            seen.append(await receive())

    async def receive() -> Message:
        return arriving.pop(0)

    async def send(_: Message) -> None: ...

    asyncio.run(
        transfers(app)(
            {"type": "http", "headers": [(b"content-encoding", coding.encode())]}, receive, send
        )
    )
    body = b"".join(message["body"] for message in seen[:-1])
    assert json.loads(body) == POSE
    assert [message["more_body"] for message in seen[:-1]] == [True] * (len(seen) - 2) + [False]
