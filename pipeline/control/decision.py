"""What an attempt is told, and what it reports: strategy, cause of its end, decisions taken."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import PolicyName
from pipeline.control.cloud import DepthPicture
from pipeline.control.ranking import Ranking


class Cause(StrEnum):
    """Why an attempt ended; LIFTED is the good one."""

    LIFTED = "lifted"
    CAMERA_STOPPED = "camera stopped"
    EMPTY_CLOUD = "empty cloud"
    NO_CANDIDATE = "no candidate"
    UNREACHABLE = "unreachable"
    COLLISION = "collision"
    NO_CONTACT = "no contact"
    NO_SEAL = "no seal"
    LOST_IN_LIFT = "lost in lift"
    LOST_IN_SHAKE = "lost in shake"
    OFF_THE_TABLE = "object off the table"


@dataclass(frozen=True)
class Strategy:
    """How attempts are made.

    Attributes
    ----------
    several_views
        Whether the wrist looks before the choice.
    corrects
        Whether it looks again on the way down.
    feels
        Whether the wrench is heeded: what the first tug shows not to hold is grasped elsewhere,
        nearer to the load's centre where one is felt, and the lift is trimmed.
    """

    name: PolicyName
    ranking: Ranking
    several_views: bool
    corrects: bool
    feels: bool


@dataclass(eq=False)
class Decision:
    """How an attempt went, as far as the policy knows; filled in as it goes.

    Attributes
    ----------
    spoilt_m
        Contacts that did not hold in the first tug.
    """

    cause: Cause = Cause.EMPTY_CLOUD
    candidates: Float[np.ndarray, "k 4 4"] = field(default_factory=lambda: np.empty((0, 4, 4)))
    quality: Float[np.ndarray, " k"] = field(default_factory=lambda: np.empty(0))
    predicted_quality: float = 0.0
    world_from_contact: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))
    corrections: int = 0
    regrasps: int = 0
    spoilt_m: list[Float[np.ndarray, " 3"]] = field(default_factory=list)
    pictures: list[DepthPicture] = field(default_factory=list)
