"""Settings of the service, from environment variables."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from contextlib import suppress
from importlib.util import find_spec
from ipaddress import IPv4Network, IPv6Network
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import AliasChoices, Field, ValidationError, ValidationInfo, field_validator
from pydantic_settings import BaseSettings, NoDecode, SettingsConfigDict

_NAMES = {
    "allowed_hosts": (
        re.compile(r"[A-Za-z0-9._-]+"),
        "not a host name: give names without scheme and port, for example `robots.example`",
    ),
    "cors_origins": (
        re.compile(r"https?://([A-Za-z0-9._-]+|\[[0-9A-Fa-f:.]+\])(:[0-9]{1,5})?"),
        "not an origin: give only scheme, name and port, for example `https://cell4.example`",
    ),
}
"""Settings with lists of names: the form of a name, and the end of the error message."""
_PASSWORD = re.compile(r"(?<=//).*(?=@)")
_SCHEDULER = re.compile(r"(tcp|tls)://[A-Za-z0-9._:\[\]-]+:[0-9]{1,5}")
SERVICE_LINK = re.compile(r"(tcp|udp|sctp)://[^/]+:[0-9]+")
"""What Kubernetes sets as `JOULEPATH_PORT` in the pods beside a service named `joulepath`."""
LONGEST_DEADLINE = 3600.0
"""Longest deadline [s] of all settings."""


def _default_database() -> str:
    """URL of an SQLite file in the user's state folder (XDG base directory specification)."""
    state = Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state")
    return f"sqlite:///{state / 'joulepath' / 'joulepath.db'}"


class Settings(BaseSettings):
    """Read from `JOULEPATH_*`, e.g. `JOULEPATH_WORKERS=4`; the port also from `PORT`."""

    model_config = SettingsConfigDict(env_prefix="JOULEPATH_", frozen=True)

    host: str = Field(default="127.0.0.1", description="Address to listen on.")
    port: int = Field(
        default=8000,
        ge=0,
        le=65535,
        validation_alias=AliasChoices("JOULEPATH_PORT", "PORT"),
        description="TCP port.",
    )
    api_keys_file: Path | None = Field(
        default=None,
        description="File of API keys, which every request then needs: see `joulepath keys`.",
    )
    open: bool = Field(
        default=False,
        description="Whether the service may listen on an address of the network without API "
        "keys. If there are keys, they stay mandatory.",
    )
    allowed_hosts: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(),
        description="Names under which clients reach the service, separated by commas. Addresses, "
        "`localhost`, the "
        "host's own name and `host` are always among them; `*` stands for any name.",
    )
    cors_origins: Annotated[tuple[str, ...], NoDecode] = Field(
        default=(),
        description="Origins of web pages that may call the service, e.g. `https://cell4.example`, "
        "separated by "
        "commas; `*` stands for any.",
    )
    trusted_proxies: Annotated[tuple[IPv4Network | IPv6Network, ...], NoDecode] = Field(
        default=(),
        description="Addresses or networks of the reverse proxies whose reports of the client's "
        "address are trusted, separated by commas.",
    )
    proxy_header: Literal["X-Forwarded-For", "Forwarded"] = Field(
        default="X-Forwarded-For",
        description="Header in which these proxies report the client's address; the other "
        "header is not trusted.",
    )
    log_level: Literal["debug", "info", "warning", "error"] = Field(
        default="info", description="Lowest level that is logged."
    )
    workers: int = Field(
        default_factory=lambda: len(os.sched_getaffinity(0)),
        ge=1,
        description="Worker processes; each solves one request at a time. Default: the CPUs that "
        "this process may use.",
    )
    robots: Annotated[tuple[str, ...], NoDecode] = Field(
        default=("ur5e",),
        description="Robots whose kernels every worker loads before it is ready, separated by "
        "commas; others at "
        "their first request.",
    )
    max_robots: int = Field(
        default=100, ge=0, description="Largest number of robots added by users."
    )
    max_figures: int = Field(
        default=1000, ge=0, description="Largest number of stored identified figures."
    )
    queue_size: int = Field(
        default=64,
        ge=0,
        description="Requests that may wait for a worker; further requests are `busy`.",
    )
    client_requests: int = Field(
        default=16,
        ge=1,
        description="Requests of one client that may be in a worker or wait for one; further ones "
        "are "
        "`too-many-requests`.",
    )
    max_connections: int = Field(default=512, ge=1, description="Connections that may be open.")
    client_connections: int = Field(
        default=128,
        ge=1,
        description="Largest number of open connections of one address, except trusted proxies, "
        "and of requests of one client without a complete answer.",
    )
    max_bytes_in_flight: int = Field(
        default=1 << 28,
        ge=1024,
        description="Largest total size of the bodies and answers of all requests in flight "
        "[byte].",
    )
    client_bytes_in_flight: int = Field(
        default=1 << 27, ge=1024, description="Largest total size of those of one client [byte]."
    )
    max_head_bytes: int = Field(
        default=32_768,
        ge=1024,
        description="Largest size of the line and the headers of a request [byte].",
    )
    head_timeout: float = Field(
        default=10.0,
        gt=0,
        description="Time in which the line and the headers of a request must arrive [s].",
    )
    body_timeout: float = Field(
        default=60.0,
        gt=0,
        description="Time in which the body of a request must arrive, uploads included [s].",
    )
    write_timeout: float = Field(
        default=20.0,
        gt=0,
        description="Time in which a client must read the next 64 KiB of its answer [s].",
    )
    max_body_bytes: int = Field(
        default=8_388_608, ge=1024, description="Largest request body [byte]."
    )
    max_upload_bytes: int = Field(
        default=67_108_864,
        ge=1024,
        description="Largest body of `POST /evaluate` and `POST /logs` [byte]; it goes to a file.",
    )
    max_iteration_bytes: int = Field(
        default=1 << 20,
        ge=1024,
        description="Largest body of `POST /studies/{id}/iterations` and of `POST /whatif` [byte].",
    )
    max_job_bytes: int = Field(
        default=67_108_864, ge=1024, description="Largest body of `POST /jobs` [byte]."
    )
    job_workers: int | None = Field(
        default=None,
        ge=1,
        description="Workers that jobs may use at the same time. Default: one less than all "
        "workers, at least 1.",
    )
    cluster: str | None = Field(
        default=None,
        description="Scheduler of a Dask cluster that works on jobs, e.g. "
        "`tcp://scheduler:8786`. Without one, the service's own workers compute "
        "them.",
    )
    max_waiting: int = Field(
        default=100_000,
        ge=1,
        description="Requests of jobs that may wait in the database; further jobs are `busy`.",
    )
    max_job_deadline: float = Field(
        default=LONGEST_DEADLINE,
        gt=0,
        le=LONGEST_DEADLINE,
        description="Longest deadline that a request of a job may have [s].",
    )
    max_deadline: float = Field(
        default=120.0, gt=0, le=600, description="Longest deadline that a request may have [s]."
    )
    deadline_grace: float = Field(
        default=5.0,
        gt=0,
        description="Time after the deadline [s] at which a worker that has not answered is "
        "killed.",
    )
    stop_grace: float = Field(
        default=0.3,
        gt=0,
        description="Time [s] in which a worker must end a task whose result is no longer "
        "wanted, before it is killed. Most computations check every few "
        "milliseconds, and starting a new worker takes longer.",
    )
    shutdown_grace: float = Field(
        default=6.0,
        gt=0,
        description="Time [s] for the requests in progress at a shutdown; everything ends at "
        "most 2 s later.",
    )
    database_url: str = Field(
        default_factory=_default_database,
        description="Database of studies and stored answers: `sqlite:///<file>` or "
        "`postgresql://user:password@host/name`. "
        "Default: an SQLite file in `$XDG_STATE_HOME/joulepath`, that is "
        "`~/.local/state/joulepath`.",
    )
    answers_max_bytes: int = Field(
        default=1 << 29,
        ge=0,
        description="Largest total size [byte], compressed, of stored answers that belong to no "
        "study; the oldest are "
        "deleted.",
    )
    logs_max_bytes: int = Field(
        default=1 << 30,
        ge=0,
        description="Largest total size of the stored logs [byte], compressed; a further one is "
        "`too-many-logs`.",
    )
    answers_max_age: float = Field(
        default=30.0,
        gt=0,
        le=36500,
        description="Age at which an answer that belongs to no study is deleted [days].",
    )

    @property
    def workers_for_jobs(self) -> int:
        """Workers available to jobs at the same time."""
        return min(self.job_workers or max(1, self.workers - 1), self.workers)

    @field_validator("port", mode="before")
    @classmethod
    def _unless_link(cls, given: Any) -> Any:
        """`PORT` or the default in place of the address of a Kubernetes service."""
        if isinstance(given, str) and SERVICE_LINK.fullmatch(given):
            return os.environ.get("PORT", cls.model_fields["port"].default)
        return given

    @field_validator("robots", "trusted_proxies", "allowed_hosts", "cors_origins", mode="before")
    @classmethod
    def _listed(cls, given: Any) -> Any:
        return (
            tuple(name.strip() for name in given.split(",") if name.strip())
            if isinstance(given, str)
            else given
        )

    @field_validator("allowed_hosts", "cors_origins")
    @classmethod
    def _names(cls, names: tuple[str, ...], field: ValidationInfo) -> tuple[str, ...]:
        pattern, remedy = _NAMES[str(field.field_name)]
        for name in names:
            if name != "*" and not pattern.fullmatch(name):
                raise ValueError(f"{name!r} is {remedy}")
        return tuple(name.lower() for name in names)

    @field_validator("cluster")
    @classmethod
    def _scheduler(cls, address: str | None) -> str | None:
        if address is not None:
            if not _SCHEDULER.fullmatch(address):
                raise ValueError(
                    f"{address!r} is not the address of a scheduler: give it as "
                    "`tcp://scheduler:8786`"
                )
            if find_spec("distributed") is None:
                raise ValueError("a cluster needs Dask: install `joulepath[cluster]`")
        return address

    @field_validator("database_url")
    @classmethod
    def _database(cls, given: str) -> str:
        from sqlalchemy import make_url  # the default needs no check
        from sqlalchemy.exc import ArgumentError

        with suppress(ArgumentError, ValueError):
            url = make_url(given)
            is_file = url.drivername == "sqlite" and not url.host
            if url.database and (is_file or url.get_backend_name() == "postgresql"):
                return given
        raise ValueError(
            "this is not a database of the service: give `sqlite:////folder/file` (of an "
            "absolute path) or `postgresql://user:password@host/name`"
        )

    @field_validator("robots")
    @classmethod
    def _known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        from joulepath.models.registry import (
            robot_names,
        )  # the default needs no check, and the service starts sooner

        unknown = [name for name in names if name not in robot_names()]
        if unknown:
            raise ValueError(
                f"there is no robot named {unknown[0]!r}: use some of {', '.join(robot_names())}"
            )
        return names


class WrongSettings(Exception):
    """Invalid environment variables; the message has one line per variable."""


def read_settings(given: Mapping[str, Any] | None = None) -> Settings:
    """The settings of this environment, updated by `given`. Raises WrongSettings."""
    try:
        return Settings(**(given or {}))
    except ValidationError as error:
        prefix = Settings.model_config["env_prefix"]
        lines = []
        for each in error.errors():
            name = str(each["loc"][0])
            variable = name if name.startswith(prefix) else f"{prefix}{name.upper()}"
            value = _PASSWORD.sub("***", repr(each["input"]))
            lines.append(f"{variable}={value}: {each['msg'].removeprefix('Value error, ')}")
        raise WrongSettings("\n".join(lines)) from error
