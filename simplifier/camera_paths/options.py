"""What a user can choose for a walk or a flight."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

from simplifier.checks import check_length, check_one_of, check_whole, check_within, settle_numbers
from simplifier.errors import OptionError
from simplifier.options import Axis

PathKind = Literal["street", "roof", "inside"]


@dataclass(frozen=True)
class PathOptions:
    """A walk or a flight through a scene."""

    kind: PathKind
    """``street``: between the objects; ``roof``: above them; ``inside``: through rooms."""

    frames: int = 60
    """Cameras, 1 to 100,000.  More lie closer together or lead further."""

    up: Axis = "y"
    """The scene's up axis."""

    seed: int = 0
    """Seed of every random choice, 0 to 2**63 - 1; another one gives another path."""

    eye_height: float = 1.7
    """World units, above 0: of a walker's eyes over the ground.  All other lengths of a path are
    multiples of it; 1.7 is right where the unit is a metre."""

    fov: float = 60.0
    """Vertical field of view, degrees, 1 to 170."""

    def __post_init__(self) -> None:
        settle_numbers(self)
        check_one_of("kind", self.kind, get_args(PathKind))
        check_whole("frames", self.frames, 1, 100_000)
        check_one_of("up", self.up, get_args(Axis))
        check_whole("seed", self.seed, 0, 2**63 - 1)
        check_length("eye height", self.eye_height)
        if self.eye_height == 0.0:
            raise OptionError("0 is no height", where="eye height", remedy="give a positive length")
        check_within("fov", self.fov, 1.0, 170.0)
