"""Request of `POST /placement`."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator
from pydantic_core import PydanticCustomError

from joulepath.app.api.cycle.request import CycleRequest, PlainName
from joulepath.app.schemas.common import IDENTITY, Pose, Request, described
from joulepath.app.schemas.deadline import DeadlineSeconds, WithBodies
from joulepath.app.schemas.examples.values import OPTIMIZE, at
from joulepath.models.shape_sizes import SIZES
from joulepath.optimizer.placement.map_axis import MAP
from joulepath.optimizer.placement.placement import PLACEMENT_RANGES
from joulepath.optimizer.placement.region import REGION_RANGES, Mount
from joulepath.optimizer.problem.cycle import CYCLE_RANGES
from joulepath.optimizer.problem.scene import SCENE_RANGES

Length = Annotated[float, Field(ge=-SIZES.largest, le=SIZES.largest)]
Lengths = Annotated[list[Length], Field(min_length=2, max_length=2)]
Yaw = Annotated[float, Field(ge=-REGION_RANGES.widest_yaw, le=REGION_RANGES.widest_yaw)]

CYCLE: dict[str, Any] = {"start": OPTIMIZE["start"], "stops": [{"target": OPTIMIZE["goal"]}]}


def _range_of(name: str) -> Any:
    return described(
        f"Least and greatest {name}. Null: the nominal one.", "m", [-0.3, 0.3], default=None
    )


class Region(Request):
    """Ranges of a place in the world: of the base frame itself, or of the offset of a group."""

    x: Lengths | None = _range_of("x")
    y: Lengths | None = _range_of("y")
    z: Lengths | None = _range_of("z")
    yaw: Annotated[list[Yaw], Field(min_length=2, max_length=2)] | None = described(
        "Least and greatest angle about the world's z axis: of the x axis of a base on the floor "
        "or the ceiling, of the z axis of a base on a wall. A group turns about the vertical "
        "through the mean of its stops. Null: the nominal one.",
        "rad",
        [-0.5, 0.5],
        default=None,
    )
    mounts: Annotated[list[Mount], Field(min_length=1, max_length=3)] | None = described(
        "Allowed mounts of the base, the nominal one among them: `floor` with its z axis up, "
        "`wall` with its z axis horizontal along `yaw` and its x axis down, `ceiling` with its z "
        "axis down. Null: the nominal orientation, turned by `yaw` alone.",
        None,
        ["floor", "ceiling"],
        default=None,
    )


class Places(Request):
    """A list of places."""

    places: Annotated[list[Pose], Field(min_length=1, max_length=REGION_RANGES.max_places)] = (
        described(
            "Poses of the base in the world, or offsets of a group from the given poses. The "
            "nominal place is added.",
            None,
            [at(0.0, 0.0, 0.0), at(0.2, 0.0, 0.0)],
        )
    )


def _by_places(value: Any) -> str | None:
    if isinstance(value, dict):
        return "by places" if "places" in value else "by ranges"
    if isinstance(value, Places):
        return "by places"
    return "by ranges" if isinstance(value, Region) else None


RegionOrPlaces = Annotated[
    # clients that try one after the other would read any object as ranges
    Annotated[Places, Tag("by places")] | Annotated[Region, Tag("by ranges")],
    Discriminator(
        _by_places,
        custom_error_type="region",
        custom_error_message="Give an object with ranges, or one with `places`",
    ),
]


class Group(Request):
    """Stops and obstacles moved together as one rigid body."""

    stops: Annotated[list[PlainName], Field(max_length=CYCLE_RANGES.max_stops)] = described(
        "Names of stops; `start` is the start of a cycle.", None, ["pick"], default=[]
    )
    obstacles: Annotated[list[PlainName], Field(max_length=SCENE_RANGES.max_obstacles)] = described(
        "Names of obstacles.", None, ["conveyor"], default=[]
    )


def _by_what(value: Any) -> str | None:
    if isinstance(value, str):
        return "by word"
    if isinstance(value, list):
        return "by list"
    return "by group" if isinstance(value, dict | Group) else None


BaseOrGroup = Annotated[
    Annotated[Literal["base"], Tag("by word")] | Annotated[Group, Tag("by group")],
    Discriminator(
        _by_what,
        custom_error_type="moves",
        custom_error_message='Give "base", or an object with `stops` and `obstacles`',
    ),
]
_REGION: dict[str, Any] = {"x": [-0.3, 0.3], "y": [-0.2, 0.2], "z": [0.0, 0.3]}


class Moving(Request):
    """A movable body and its region."""

    moves: BaseOrGroup = described(
        "`base`, or stops and obstacles that move together.", None, {"stops": ["pick"]}
    )
    region: RegionOrPlaces = described("Admissible places of the body.", None, _REGION)


class WeightedCycle(WithBodies):
    """A cycle, and how often it runs."""

    cycle: CycleRequest = described("A body of `POST /cycle`.", None, CYCLE)
    weight: float = described(
        "Number of runs, per any unit of time that all cycles share.",
        "1",
        3.0,
        default=1.0,
        gt=0,
        le=PLACEMENT_RANGES.max_weight,
    )


class PlacementRequest(WithBodies):
    """Cycles with stops and obstacles in the world frame, and the admissible places of the robot.
    Exactly one of `cycle` and `cycles` is given."""

    cycle: CycleRequest | None = described(
        "A body of `POST /cycle`, with poses, obstacles, directions and `gravity` in the world. "
        "Joint positions stay as they are. A motion is a cycle of one stop that is not `closed`.",
        None,
        CYCLE,
        default=None,
    )
    cycles: (
        Annotated[list[WeightedCycle], Field(min_length=1, max_length=PLACEMENT_RANGES.max_cycles)]
        | None
    ) = described(
        "Several cycles of the same robot, with the relative number of their runs.",
        None,
        [{"cycle": CYCLE, "weight": 3.0}],
        default=None,
    )
    base: Pose = described(
        "Nominal pose of the robot base in the world. By default, the world is the frame of the "
        "nominal base.",
        None,
        {"position": [0.0, 0.0, 0.4], "quaternion": [0.0, 0.0, 0.0, 1.0]},
        default=IDENTITY,
    )
    region: RegionOrPlaces | None = described(
        "Where the base may be in the world, or how far the group may move. It must contain the "
        "nominal place. Null: `moves` is a list.",
        None,
        _REGION,
        default=None,
    )
    moves: Annotated[
        Annotated[Literal["base"], Tag("by word")]
        | Annotated[Group, Tag("by group")]
        | Annotated[
            Annotated[list[Moving], Field(min_length=1, max_length=PLACEMENT_RANGES.max_moved)],
            Tag("by list"),
        ],
        Discriminator(
            _by_what,
            custom_error_type="moves",
            custom_error_message='Give "base", an object with `stops` and `obstacles`, or a list',
        ),
    ] = described(
        "What moves: `base`, or a group of stops and obstacles, such as a fixture or a pallet; or "
        "a list of both, each with its own `region`.",
        None,
        {"stops": ["pick"], "obstacles": ["conveyor"]},
        default="base",
    )
    resolution: float | None = described(
        "Largest distance between neighbouring places of the map; 0.15 m count like one radian of "
        f"yaw. Null: so that the map has at most {MAP.points} places, where that is possible.",
        "m",
        0.1,
        default=None,
        ge=PLACEMENT_RANGES.finest,
        le=PLACEMENT_RANGES.coarsest,
    )
    deadline: DeadlineSeconds = described(
        "Wall time from the arrival of the request, including the wait for a worker. When it "
        "nears, the service returns the best place and the map so far. The `deadline` of a cycle "
        "is the longest time for it at one place.",
        "s",
        120.0,
        default=120.0,
    )

    @model_validator(mode="after")
    def _one_of_both(self) -> Self:
        if (self.cycle is None) == (self.cycles is None):
            raise PydanticCustomError("exactly_one", "Give exactly one of `cycle` and `cycles`")
        return self

    @model_validator(mode="after")
    def _has_regions(self) -> Self:
        if isinstance(self.moves, list) != (self.region is None):
            raise PydanticCustomError(
                "region", "Give a `region`, or a list of `moves` with a region each"
            )
        return self

    @property
    def weighted(self) -> list[WeightedCycle]:
        """All cycles with their weights."""
        if self.cycles is not None:
            return self.cycles
        assert self.cycle is not None
        return [WeightedCycle(cycle=self.cycle)]

    @property
    def robot(self) -> str:
        """Name of the robot."""
        return self.weighted[0].cycle.robot

    @property
    def figures(self) -> str | None:
        """Id of identified figures."""
        return self.weighted[0].cycle.figures
