"""The strategy of an attempt, and the record of its decisions and of how it ended."""

import math
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from jaxtyping import Float

from pipeline.config.evaluation import PolicyName
from pipeline.control.cloud import DepthPicture
from pipeline.control.ranking import Ranking


class Cause(StrEnum):
    """Why an attempt ended; LIFTED is success."""

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
    LOST_IN_TRANSPORT = "lost in transport"
    OFF_THE_TABLE = "object off the table"


@dataclass(frozen=True)
class Strategy:
    """How attempts are made.

    Attributes
    ----------
    name
        The policy's name in the configuration.
    ranking
        Gives the quality of each candidate.
    several_views
        Whether the wrist's camera takes pictures before the choice.
    corrects
        Whether it takes pictures during the approach and the aim is corrected by them.
    seals_again
        Whether, after a tug that does not hold, another place is sealed in the same attempt.
    feels
        Whether the measured wrench says where: nearer to the load's centre where one was measured;
        and whether the lift is trimmed by it.
    """

    name: PolicyName
    ranking: Ranking
    several_views: bool
    corrects: bool
    seals_again: bool
    feels: bool


@dataclass(frozen=True, eq=False)
class TriedContact:
    """A contact at which the vacuum was switched on.

    Attributes
    ----------
    world_from_contact
        The contact as it was aimed at, shape (4, 4).
    quality
        Its q-hat.
    pictures
        Depth images by which it was aimed at.
    held
        Whether an object hung on the pad after the first tug.
    vacuum
        Largest vacuum felt before that, over the pump's greatest; NaN where nothing measures it.
    """

    world_from_contact: Float[np.ndarray, "4 4"]
    quality: float
    pictures: list[DepthPicture]
    held: bool
    vacuum: float = math.nan


@dataclass(eq=False)
class Decision:
    """What the policy decided in one attempt; the attempt fills it in as it goes.

    Attributes
    ----------
    cause
        Why the attempt ended.
    candidates
        world_from_contact of the last global phase's candidates, shape (k, 4, 4).
    quality
        Their q-hat, shape (k,).
    predicted_quality
        q-hat of the contact aimed at last.
    world_from_contact
        The contact aimed at last, shape (4, 4).
    corrections
        How often the aim was corrected by a picture.
    regrasps
        How often the object was grasped again after a tug that did not hold.
    seals
        How often the vacuum was switched on.
    carried_m_s2
        Largest acceleration of the transport that the object bore; 0 for none.
    failed_contacts_m
        Contacts in WCS that did not hold in the first tug [m], each of shape (3,).
    pictures
        Depth images that the last choice was made from.
    aimed_by
        Depth images by which the contact aimed at last was found: those of the choice, or the
        one that corrected it.
    tried
        Every contact at which the vacuum was switched on, in order.
    """

    cause: Cause = Cause.EMPTY_CLOUD
    candidates: Float[np.ndarray, "k 4 4"] = field(default_factory=lambda: np.empty((0, 4, 4)))
    quality: Float[np.ndarray, " k"] = field(default_factory=lambda: np.empty(0))
    predicted_quality: float = 0.0
    world_from_contact: Float[np.ndarray, "4 4"] = field(default_factory=lambda: np.eye(4))
    corrections: int = 0
    regrasps: int = 0
    seals: int = 0
    carried_m_s2: float = 0.0
    failed_contacts_m: list[Float[np.ndarray, " 3"]] = field(default_factory=list)
    pictures: list[DepthPicture] = field(default_factory=list)
    aimed_by: list[DepthPicture] = field(default_factory=list)
    tried: list[TriedContact] = field(default_factory=list)
