"""Answers to requests by the schemas and tasks of the service."""

from __future__ import annotations

import signal
import sys
import uuid
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
import orjson

from joulepath.app.cli import terminal
from joulepath.app.cli.exit_codes import of_error
from joulepath.app.cli.store import robot_named, run_with_store

if TYPE_CHECKING:
    from joulepath.app.engine.task import Task
    from joulepath.app.schemas.common import Request

M = TypeVar("M", bound="Request")

FILE: Callable[[Any], Any] = click.argument(
    "file", type=click.Path(exists=True, dir_okay=False, allow_dash=True)
)
OUTPUT: Callable[[Any], Any] = click.option(
    "--output",
    "-o",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the answer to this file instead of standard output.",
)
MOVES: Callable[[Any], Any] = click.option(
    "--answers",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder with the answers of a cycle's moves, as `joulepath cycle --answers` writes it. "
    "Default: the database.",
)


def new_id() -> str:
    """An id for a request: its answer or its problem holds it."""
    return str(uuid.uuid4())


def content_of(file: str) -> bytes:
    """The bytes of a file, or of standard input for `-`."""
    return sys.stdin.buffer.read() if file == "-" else Path(file).read_bytes()


def validated(model: type[M], body: bytes) -> M:
    """The request in a JSON body. Raises InvalidRequest."""
    from pydantic import ValidationError

    from joulepath.app.convert.json_text import parsed_json
    from joulepath.app.exceptions.base import InvalidRequest
    from joulepath.app.http.problems import invalid_request
    from joulepath.app.schemas.deadline import given_deadline, too_long
    from joulepath.app.settings import LONGEST_DEADLINE

    try:
        asked = model.model_validate(parsed_json(body))
    except ValidationError as error:
        raise invalid_request(error, "body") from None
    if wrong := too_long(given_deadline(asked), LONGEST_DEADLINE, "body"):
        raise InvalidRequest(wrong)
    return asked


def answered(task: Task, deadline: float, answers: Path | None = None) -> bytes:
    """The answer of a task in at most `deadline` [s], with the answers of moves in a folder."""
    result = run_with_store(task, deadline, answers)
    return (result if result.kept_as is None else result.not_kept()).document


def show_problem(error: Exception) -> int:
    """Writes an error to standard error: in words on a terminal, else as a problem in JSON (RFC
    9457). Returns the exit code; raises an unforeseen error again.
    """
    from joulepath.app.client.errors import ServiceUnreachable
    from joulepath.app.engine.result import json_document
    from joulepath.app.http.problems import problem_of, reported
    from joulepath.optimizer.exceptions import DeclaredError

    if not isinstance(error, DeclaredError):
        raise error
    if isinstance(error, ServiceUnreachable):
        remedy = ""
        problem = {"type": "about:blank", "title": "Service unreachable", "detail": str(error)}
    else:
        remedy, problem = reported(error).remedy, problem_of(error, new_id())
    shown = json_document(problem)
    if sys.stderr.isatty():
        shown = terminal.problem(orjson.loads(shown), remedy).encode()
    click.echo(shown, err=True)
    return of_error(error)


def compile_kernel_of(robot_name: str) -> None:
    """Compiles the robot's kernel for the cache, which an earlier end of the process would prevent.

    Without a C compiler, or for an unknown robot, nothing happens. A hanging compiler is reported
    and given up.
    """
    from joulepath.app.exceptions.stored import StoreUnavailable
    from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
    from joulepath.optimizer.exceptions import UnknownRobot
    from joulepath.optimizer.native.library_cache import CACHE, CompilerHangs

    settings = replace(CACHE, compiler_timeout=CACHE.command_timeout)
    try:
        with terminal.steps("Equations of motion (compiled once per robot)"):
            compile_kernel(robot_named(robot_name), settings=settings)
    except (UnknownRobot, StoreUnavailable):
        return  # the answer reports this error
    except CompilerHangs as error:
        click.echo(
            f"Without a compiled kernel, the computation takes longer: {error}. Name another one "
            "by CC.",
            err=True,
        )
    except (RuntimeError, OSError):
        return  # CasADi's virtual machine evaluates the same expressions


def write(answer: bytes, output: Path | None) -> None:
    """Writes an answer to a file, or to standard output. Raises click.FileError."""
    if output is None:
        # A closed pipe ends this process silently, like the shell's own tools; a broken connection
        # at another time is an ordinary error.
        before = signal.signal(signal.SIGPIPE, signal.SIG_DFL)
        try:
            sys.stdout.buffer.write(answer if answer.endswith(b"\n") else answer + b"\n")
            sys.stdout.buffer.flush()
        finally:
            signal.signal(signal.SIGPIPE, before)
        return
    try:
        output.write_bytes(answer)
    except OSError as error:
        raise click.FileError(str(output), error.strerror or "") from None


def json_object(content: bytes, otherwise: str) -> dict[str, Any]:
    """The JSON object in a file. Raises click.UsageError with the message `otherwise`."""
    try:
        found = orjson.loads(content)
    except orjson.JSONDecodeError:
        found = None
    if not isinstance(found, dict):
        raise click.UsageError(otherwise)
    return found


def parsed(answer: bytes) -> dict[str, Any]:
    """The fields of a JSON answer."""
    content: dict[str, Any] = orjson.loads(answer)
    return content
