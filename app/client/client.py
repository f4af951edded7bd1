"""The functions of the library over HTTP."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Self

from joulepath.app.client.encoding import base_url, json_text, key_header, part
from joulepath.app.client.errors import Json, ServiceUnreachable, error_in, json_in
from joulepath.app.client.waiting import ended
from joulepath.optimizer.presentation.extras import required


class Client:
    """A connection to the service.

    Requests are dictionaries, or keyword arguments, with the fields of the HTTP contract; answers
    are the dictionaries of its JSON. Errors are the library's own, such as `UnreachablePose`, or
    those of the service, such as `InvalidRequest`; each is a `JoulepathError` with plain data.

        client = joulepath.Client("http://127.0.0.1:8000")
        answer = client.optimize(robot="ur10e", start={"q": […]}, goal={"pose": {…}})

    A client is a context manager, and may be shared by threads.
    """

    def __init__(self, url: str, key: str | None = None, *, http: Any = None) -> None:
        """Make a client; no request is sent.

        Args:
            url: address of the service.
            key: API key, if the service asks for one; blanks around it are left out.
            http: client of httpx to send requests with, for its proxies or certificates; its own
                base address and timeouts are kept.

        Raises:
            InvalidProblem: the address or the key is no text.
            Unauthenticated: the key has characters that no key has.
            ModuleNotFoundError: httpx is not installed.
        """
        self._url = base_url(url)
        self._headers = key_header(key)
        self._httpx = required("httpx2", "Client", "joulepath[client]")
        # the deadline of a request bounds the time of its answer
        timeout = self._httpx.Timeout(10.0, read=None)
        self._http = http or self._httpx.Client(timeout=timeout)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close all connections."""
        self._http.close()

    def optimize(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Find the motion of least energy: `POST /optimize`."""
        return self._post("/optimize", request, fields)

    def compare(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Solve one request by several methods: `POST /compare`."""
        return self._post("/compare", request, fields)

    def pareto(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Find the front of energy over duration: `POST /pareto`."""
        return self._post("/pareto", request, fields)

    def plan_cycle(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Find the cycle of least energy: `POST /cycle`."""
        return self._post("/cycle", request, fields)

    def place(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Find where to put the robot: `POST /placement`."""
        return self._post("/placement", request, fields)

    def evaluate(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Compute the energy of a given motion: `POST /evaluate`."""
        return self._post("/evaluate", request, fields)

    def what_if(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Compare a motion on changed arms: `POST /whatif`."""
        return self._post("/whatif", request, fields)

    def inverse_kinematics(
        self, request: Mapping[str, Any] | None = None, /, **fields: Any
    ) -> Json:
        """Find all configurations of a pose: `POST /ik`."""
        return self._post("/ik", request, fields)

    def replay(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Play a motion in MuJoCo: `POST /replay`."""
        return self._post("/replay", request, fields)

    def excitation(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Find a motion that tells an arm's parameters apart: `POST /excitation`."""
        return self._post("/excitation", request, fields)

    def export(self, answer: Mapping[str, Any] | str, format: str, **options: Any) -> bytes:
        """Write a motion as a file for a controller: `POST /export/{format}`.

        Args:
            answer: an answer, or its id.
            format: name of the format.
            options: further fields, such as `speed_scale`.

        Returns:
            The content of the file.
        """
        body = {"answer": answer, **options}
        content: bytes = self._send("POST", f"/export/{part(format)}", json=body).content
        return content

    def read_log(self, file: str | PathLike[str], **settings: Any) -> Json:
        """Add a log of an arm: `POST /logs`.

        Args:
            file: CSV file, or one packed by gzip.
            settings: settings of the log, such as `robot` and `units`.

        Returns:
            The log; its `id` stands for it in `identify`.
        """
        query = {name: json_text(value) for name, value in settings.items()}
        headers = {"Content-Type": "text/csv"}
        return self._json(
            "POST", "/logs", params=query, content=Path(file).read_bytes(), headers=headers
        )

    def identify(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Begin to identify an arm's own figures: `POST /identifications`.

        Returns:
            The identification as it stands; see `wait_for_identification`.
        """
        return self._post("/identifications", request, fields)

    def wait_for_identification(
        self, id: str, period: float = 1.0, patience: float = 300.0
    ) -> Json:
        """Wait until an identification has ended, as `wait_for_job` does.

        Args:
            id: id of the identification.
            period: time between two looks [s].
            patience: longest time without an answer of the service, once there was one [s].

        Returns:
            The identification with its `state`, and its `result` or its `problem`.
        """
        return ended(lambda: self.get(f"/identifications/{part(id)}"), period, patience)

    def advice(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Find changes of a motion or a cycle that need less energy: `POST /advice`."""
        return self._post("/advice", request, fields)

    def report(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> bytes:
        """Write a page on a motion or a cycle: `POST /report`.

        Returns:
            The page, as HTML or as PDF.
        """
        content: bytes = self._send("POST", "/report", json={**(request or {}), **fields}).content
        return content

    def load_robot(self, name: str) -> Json:
        """All parameters of a robot: `GET /robots/{name}`."""
        return self.get(f"/robots/{part(name)}")

    def mjcf(self, name: str) -> str:
        """The MJCF of a robot, for MuJoCo: `GET /robots/{name}/mjcf`."""
        return self._text(f"/robots/{part(name)}/mjcf")

    def joint_limits(self, name: str, **query: Any) -> str:
        """The `joint_limits.yaml` of a robot: `GET /robots/{name}/joint_limits`."""
        return self._text(f"/robots/{part(name)}/joint_limits", params=query)

    def robot_names(self) -> tuple[str, ...]:
        """Names of all robots: `GET /robots`."""
        return tuple(each["name"] for each in self.get("/robots")["robots"])

    def load_tool(self, name: str) -> Json:
        """All figures of a tool: `GET /tools/{name}`."""
        return self.get(f"/tools/{part(name)}")

    def tool_names(self) -> tuple[str, ...]:
        """Names of all tools: `GET /tools`."""
        return tuple(each["name"] for each in self.get("/tools")["tools"])

    def send_job(
        self, requests: Sequence[Mapping[str, Any]], name: str | None = None, **fields: Any
    ) -> Json:
        """Let the service compute many requests while nobody waits: `POST /jobs`.

        Args:
            requests: each has one field, the name of its endpoint, such as `optimize`.
            name: name of the job.
            fields: further fields of the job.

        Returns:
            The job with its `id`.
        """
        return self._post("/jobs", None, {"requests": requests, "name": name, **fields})

    def jobs(self) -> Iterator[Json]:
        """All jobs, newest first: `GET /jobs`."""
        return self._listed("jobs")

    def job(self, id: str) -> Json:
        """A job and its first requests: `GET /jobs/{id}`."""
        return self.get(f"/jobs/{part(id)}")

    def wait_for_job(
        self,
        id: str,
        period: float = 1.0,
        tell: Callable[[Json], object] = lambda job: None,
        patience: float = 300.0,
    ) -> Json:
        """Wait until all requests of a job have ended, also while the service restarts.

        Args:
            id: id of the job.
            period: time between two looks [s].
            tell: gets the job at each look.
            patience: longest time without an answer of the service, once there was one [s].

        Returns:
            The job.
        """

        def look() -> Json:
            job = self.job(id)
            tell(job)
            return job

        return ended(look, period, patience)

    def job_results(self, id: str) -> Iterator[Json]:
        """The requests of a job that have ended, with their answers: `GET /jobs/{id}/results`."""
        lines = {"Accept": "application/x-ndjson"}
        answer = self._send("GET", f"/jobs/{part(id)}/results", headers=lines)
        for line in answer.content.splitlines():
            yield json_in(line, self._url)

    def job_table(self, id: str) -> str:
        """The figures of the ended requests of a job, as CSV: `GET /jobs/{id}/results`."""
        return self._text(f"/jobs/{part(id)}/results", headers={"Accept": "text/csv"})

    def cancel_job(self, id: str) -> Json:
        """Cancel what waits and stop what runs: `POST /jobs/{id}/cancel`."""
        return self._json("POST", f"/jobs/{part(id)}/cancel")

    def retry_job(self, id: str) -> Json:
        """Let failed and cancelled requests wait again: `POST /jobs/{id}/retry`."""
        return self._json("POST", f"/jobs/{part(id)}/retry")

    def delete_job(self, id: str) -> None:
        """Delete a job with its answers: `DELETE /jobs/{id}`."""
        self._send("DELETE", f"/jobs/{part(id)}")

    def begin_study(self, request: Mapping[str, Any] | None = None, /, **fields: Any) -> Json:
        """Begin a study, such as `name="Lift", threshold=28`: `POST /studies`."""
        return self._post("/studies", request, fields)

    def studies(self) -> Iterator[Json]:
        """All studies, newest first: `GET /studies`."""
        return self._listed("studies")

    def study(self, id: str) -> Json:
        """A study and its history: `GET /studies/{id}`."""
        return self.get(f"/studies/{part(id)}")

    def study_table(self, id: str) -> str:
        """The history of a study as CSV: `GET /studies/{id}`."""
        return self._text(f"/studies/{part(id)}", headers={"Accept": "text/csv"})

    def add_iteration(self, id: str, step: Mapping[str, Any]) -> Json:
        """Compute the next iteration of a study: `POST /studies/{id}/iterations`.

        Args:
            id: id of the study.
            step: one field, `optimize` or `evaluate`, with a body of that endpoint.
        """
        return self._post(f"/studies/{part(id)}/iterations", step, {})

    def suggestions(self, id: str) -> Json:
        """Changes of a study's best motion that need less energy: `GET /studies/{id}/suggest`."""
        return self.get(f"/studies/{part(id)}/suggest")

    def delete_study(self, id: str) -> None:
        """Delete a study with its iterations: `DELETE /studies/{id}`."""
        self._send("DELETE", f"/studies/{part(id)}")

    def get(self, path: str, **query: Any) -> Json:
        """The JSON at any path of the service, such as that in the field `answer`."""
        return self._json("GET", path, params=query)

    def rename(self, path: str, name: str | None) -> Json:
        """Give another name to something that the service keeps: `PATCH` of its path.

        Args:
            path: its path, such as `/jobs/ID`, `/studies/ID`, `/logs/ID`, `/identifications/ID`,
                `/robots/NAME`, or the field `answer` of an answer.
            name: the name; None for none. Of a robot it is the title.

        Returns:
            What is renamed, as lists show it.
        """
        field = "title" if path.startswith("/robots/") else "name"
        return self._json("PATCH", path, json={field: name})

    def _listed(self, name: str) -> Iterator[Json]:
        """The entries of all pages of a list."""
        after: Any = None
        while True:
            page = self._json("GET", f"/{name}", params={} if after is None else {"after": after})
            yield from page[name]
            after = page["next"]
            if after is None:
                return

    def _post(self, path: str, request: Mapping[str, Any] | None, fields: Json) -> Json:
        return self._json("POST", path, json={**(request or {}), **fields})

    def _json(self, method: str, path: str, **options: Any) -> Json:
        return json_in(self._send(method, path, **options).content, self._url)

    def _text(self, path: str, **options: Any) -> str:
        text: str = self._send("GET", path, **options).text
        return text

    def _send(self, method: str, path: str, **options: Any) -> Any:
        """The response. Raises the error of a problem, and ServiceUnreachable."""
        headers = {**self._headers, **options.pop("headers", {})}
        if "json" in options:
            options["content"] = json_text(options.pop("json")).encode()
            headers["Content-Type"] = "application/json"
        url = f"{self._url}/{path.removeprefix('/')}"
        try:
            answer = self._http.request(method, url, headers=headers, **options)
        except (self._httpx.RequestError, self._httpx.InvalidURL) as error:
            reason = str(error).rstrip(".") or type(error).__name__
            raise ServiceUnreachable(self._url, reason) from error
        if not answer.is_success:
            raise error_in(answer, self._url)
        return answer
