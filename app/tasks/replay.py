"""POST /replay in a worker."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from pydantic import ValidationError

from joulepath.app.convert.given_answer import paths_of_moves, to_program
from joulepath.app.convert.replay import to_perturbation, to_planned_motion, to_replayed_motion
from joulepath.app.convert.until import until
from joulepath.app.convert.warnings import replay_warnings
from joulepath.app.engine.result import TaskResult
from joulepath.app.http.problems import invalid_request
from joulepath.app.schemas.replay import ReplayRequest
from joulepath.app.tasks.kept_answers import WithKeptAnswers
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.replay.controller import ControlName
from joulepath.optimizer.replay.planned import PlannedMotion
from joulepath.optimizer.replay.replay import replay
from joulepath.optimizer.replay.simulator import mujoco

PERTURBED_NOTHING = "The arm carries no payload: to change it has no effect."
NO_BASELINES = (
    "The motions of the baselines do not follow from this answer, so that their savings are not replayed. They do for "
    "goals that are joint positions or whole poses, without a path."
)
CONTROLS: dict[Literal["feed_forward", "pd", "both"], tuple[ControlName, ...]] = {
    "feed_forward": ("feed_forward",),
    "pd": ("pd",),
    "both": ("feed_forward", "pd"),
}


@dataclass(frozen=True)
class ReplayTask(WithKeptAnswers):
    """A validated request and its id."""

    asked: ReplayRequest
    request_id: str

    def run(self, deadline: float) -> TaskResult:
        """The answer of `POST /replay`, within about `deadline` seconds.

        Raises PartsNeeded with the answers that must be kept at hand first, and what its parts raise.
        """
        simulator, end = f"MuJoCo {mujoco().__version__}", Deadline.after(deadline)
        began = end.clock()
        try:
            with until(end):
                planned = self._planned()
        except ValidationError as error:
            raise invalid_request(error, "body", "answer") from None
        warnings = list[str]()
        motions = [self._replayed(leg, motion, end, warnings) for leg, motion in planned]
        content = {
            "request": self.request_id,
            "id": None,
            "robot": planned[0][1].arm.robot.name,
            "simulator": simulator,
            "motions": motions,
            "wall_time": end.clock() - began,
            "warnings": warnings,
        }
        return TaskResult.of_json(content)

    def _planned(self) -> list[tuple[int | None, PlannedMotion]]:
        """The motions of the answer, and of a cycle the index of each in `legs`."""
        given = self.asked.answer
        answer = self.answers([given])[0] if isinstance(given, str) else given
        paths = paths_of_moves(answer)
        single = self.answers(paths) if paths else [answer]
        moves = to_program(answer, self.asked.arm, self.answers).moves
        legs: list[int | None] = [None]
        if paths:
            legs = [k for k, leg in enumerate(answer["legs"]) if leg["answer"] is not None]
        return [(leg, to_planned_motion(*each)) for leg, *each in zip(legs, moves, single, strict=True)]

    def _replayed(self, leg: int | None, planned: PlannedMotion, end: Deadline, warnings: list[str]) -> dict[str, Any]:
        """The entry of one motion; adds its warnings."""
        perturb, said = to_perturbation(self.asked.perturb), list[str]()
        if "payload" in perturb and planned.arm.payload.mass == 0:
            said.append(PERTURBED_NOTHING)
        if perturb and planned.compared and not planned.baselines:
            said.append(NO_BASELINES)
        found = replay(planned, CONTROLS[self.asked.control], self.asked.step, perturb, end.left, end.clock)
        where = "" if leg is None else f"Leg {leg}: "
        warnings += [f"{where}{words}" for words in (*said, *replay_warnings(planned, found))]
        return to_replayed_motion(planned, found, leg)
