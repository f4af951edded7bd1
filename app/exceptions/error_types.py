"""All types of errors in answers of the service."""

from __future__ import annotations

from functools import cache

from joulepath.app.exceptions import access, base, queue, report, stored, transport
from joulepath.optimizer import exceptions as library
from joulepath.optimizer.cycle import errors as sequence
from joulepath.optimizer.evaluate import errors as given_motions
from joulepath.optimizer.exceptions import DeclaredError
from joulepath.optimizer.excitation import errors as excitation
from joulepath.optimizer.export import errors as exports
from joulepath.optimizer.identify import errors as identification
from joulepath.optimizer.joint_limits import errors as joint_limits
from joulepath.optimizer.kinematics import errors as kinematics
from joulepath.optimizer.placement import errors as placements
from joulepath.optimizer.search import errors as search

_MODULES = (
    *(base, library, kinematics, search, sequence, placements, given_motions, exports),
    *(joint_limits, identification, excitation, stored, queue, access, transport, report),
)
"""Modules with declared errors, in the order of the reference."""


@cache
def types_of_error() -> tuple[type[DeclaredError], ...]:
    """All types of errors in answers of the service."""
    classes = (
        each for module in _MODULES for each in vars(module).values() if isinstance(each, type)
    )
    declared = (
        each for each in classes if issubclass(each, DeclaredError) and "title" in vars(each)
    )
    # Modules also contain imported classes.
    return tuple(dict.fromkeys(declared))
