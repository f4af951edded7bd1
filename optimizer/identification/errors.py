"""The errors of an identification, each with its data."""

from __future__ import annotations

from collections.abc import Sequence

from optimizer.exceptions import JoulepathError


class NotExcited(JoulepathError):
    """The logs tell nothing of what was asked; `parameters` are its names."""

    def __init__(self, parameters: Sequence[str]) -> None:
        super().__init__(
            "Nothing that was asked for can be identified from these logs: log motions in which every joint moves, at "
            "several speeds and in both directions."
        )
        self.parameters = list(parameters)


class NothingHeldOut(JoulepathError):
    """The logs have `moves` moves, along fewer than two different motions."""

    def __init__(self, moves: int) -> None:
        super().__init__(
            f"The logs have {moves} moves along fewer than two different motions, so that none can be held out: log at "
            "least two different motions, or name other logs in `validate`."
        )
        self.moves = moves


class NoPowerChannel(JoulepathError):
    """Power was asked for, and no log has it."""

    def __init__(self) -> None:
        super().__init__(
            "No log has the power of the arm's bus: log voltage and current of the arm, or its power. Joint currents "
            "are not taken for it, as they are no DC currents."
        )
