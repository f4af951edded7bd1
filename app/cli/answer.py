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

if TYPE_CHECKING:
    from joulepath.app.engine.result import TaskResult
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


class Refused(Exception):
    """The request is answered with a problem.

    Attributes:
        problem: its JSON (RFC 9457).
        exit_code: exit code of the command.
        remedy: what to do, in words.
    """

    def __init__(self, problem: bytes, exit_code: int, remedy: str = "") -> None:
        super().__init__(problem)
        self.problem, self.exit_code, self.remedy = problem, exit_code, remedy

    def shown(self) -> bytes:
        """What standard error shows: words on a terminal, else the JSON."""
        if not sys.stderr.isatty():
            return self.problem
        return terminal.problem(orjson.loads(self.problem), self.remedy).encode()


def new_id() -> str:
    """An id for a request: its answer or its problem holds it."""
    return str(uuid.uuid4())


def content_of(file: str) -> bytes:
    """The bytes of a file, or of standard input for `-`."""
    return sys.stdin.buffer.read() if file == "-" else Path(file).read_bytes()


def validated(model: type[M], body: bytes, request_id: str) -> M:
    """The request in a JSON body. Raises Refused."""
    from pydantic import ValidationError

    from joulepath.app.convert.json_text import parsed_json
    from joulepath.app.exceptions.base import InvalidRequest
    from joulepath.app.http.problems import invalid_request
    from joulepath.app.schemas.deadline import given_deadline, too_long
    from joulepath.app.settings import LONGEST_DEADLINE

    try:
        asked = model.model_validate(parsed_json(body))
        if wrong := too_long(given_deadline(asked), LONGEST_DEADLINE, "body"):
            raise InvalidRequest(wrong)
        return asked
    except InvalidRequest as error:
        raise refused(error, request_id) from None
    except ValidationError as error:
        raise refused(invalid_request(error, "body"), request_id) from None


def answered(task: Task, deadline: float, request_id: str, answers: Path | None = None) -> bytes:
    """The answer of a task in at most `deadline` [s], with the answers of moves in a folder.

    Raises Refused.
    """
    result = result_of(task, deadline, request_id, answers)
    return (result if result.kept_as is None else result.not_kept()).document


def result_of(
    task: Task, deadline: float, request_id: str, answers: Path | None = None
) -> TaskResult:
    """The result of a task in at most `deadline` [s], with the answers of moves in a folder.

    Raises Refused.
    """
    from joulepath.app.cli.store import run_with_store
    from joulepath.optimizer.exceptions import DeclaredError

    try:
        return run_with_store(task, deadline, answers)
    except DeclaredError as error:
        raise refused(error, request_id) from None


def refused(error: Exception, request_id: str | None = None) -> Refused:
    """The exception of a command for an error of the library or the service."""
    from joulepath.app.engine.result import json_document
    from joulepath.app.http.problems import problem_of, reported

    document = json_document(problem_of(error, request_id or new_id()))
    return Refused(document, of_error(error), reported(error).remedy)


def compile_kernel_of(robot_name: str) -> None:
    """Compiles the robot's kernel for the cache, which an earlier end of the process would prevent.

    Without a C compiler, or for an unknown robot, nothing happens. A hanging compiler is reported
    and given up.
    """
    from joulepath.app.cli.store import robot_named
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


def parsed(answer: bytes) -> dict[str, Any]:
    """The fields of a JSON answer."""
    content: dict[str, Any] = orjson.loads(answer)
    return content
