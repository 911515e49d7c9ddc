"""[evaluate] and [recording]: the closed loop, and what recordings show."""

import math
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from pipeline.config.section import LengthInMetres, ScaledSection, Section

RobotName = Literal["floating", "iiwa14"]
PolicyName = Literal["closed-loop", "uncorrected", "open-loop", "geometric"]


class SuctionConfig(Section):
    """The vacuum and the joint that carries an object."""

    vacuum_pa: float = Field(
        8000.0, gt=0, le=101_325, description="pressure difference at p = 1 of Eq. (2) [Pa]"
    )
    seal_min: float = Field(0.05, ge=0, le=1, description="least p that closes the joint [1]")


class LiftConfig(ScaledSection):
    """When a grasp counts."""

    height_m: ClassVar[LengthInMetres] = LengthInMetres()

    height_rg: float = Field(4.0, gt=0, description="lift that counts [r_G]")
    hold_s: float = Field(1.0, gt=0, description="time the object must stay up [s]")
    shake_m: float = Field(0.005, ge=0, description="amplitude of the shake before that [m]")
    shake_hz: float = Field(2.0, gt=0, description="frequency of the shake [Hz]")
    shake_s: float = Field(0.5, ge=0, description="time of the shake [s]")


class HandConfig(ScaledSection):
    """The gripper's rigid part and the camera on it, in GCS: +z from the pad to the flange."""

    length_m: ClassVar[LengthInMetres] = LengthInMetres()
    stem_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    stem_begins_m: ClassVar[LengthInMetres] = LengthInMetres()
    camera_aside_m: ClassVar[LengthInMetres] = LengthInMetres()
    camera_above_m: ClassVar[LengthInMetres] = LengthInMetres()
    camera_focus_m: ClassVar[LengthInMetres] = LengthInMetres()

    length_rg: float = Field(8.0, gt=2.0, le=40.0, description="pad to flange [r_G]")
    stem_radius_rg: float = Field(
        0.48, gt=0, le=4.0, description="radius of the rigid stem above the pad [r_G]"
    )
    stem_begins_rg: float = Field(
        1.4, gt=0, le=40.0, description="where the stem begins, past the pad's altitude H [r_G]"
    )
    camera_aside_rg: float = Field(
        6.4, ge=0, le=20.0, description="camera off the axis, along x [r_G]"
    )
    camera_above_rg: float = Field(7.2, gt=0, le=20.0, description="camera above the pad [r_G]")
    camera_focus_rg: float = Field(
        6.0, gt=0, le=80.0, description="where its axis meets the gripper's, below the pad [r_G]"
    )
    camera_radius_m: float = Field(
        0.031,
        gt=0,
        le=0.2,
        description="radius of the ball around the camera that an arm keeps clear of; L515 [m]",
    )

    @model_validator(mode="after")
    def _stem_is_there(self) -> Self:
        if self.stem_begins_rg + 2 * self.stem_radius_rg >= self.length_rg:
            raise ValueError("length_rg must exceed stem_begins_rg + 2 stem_radius_rg")
        return self


class ArmConfig(Section):
    """Where the arm stands, for `robot = "iiwa14"`."""

    base_m: tuple[float, float, float] = Field(
        (-0.62, 0.0, 0.0), description="foot of the arm, upright, in WCS [m]"
    )
    home_m: tuple[float, float, float] = Field(
        (-0.15, 0.0, 0.45), description="where the pad waits, pointing down [m]"
    )


class PolicyConfig(ScaledSection):
    """Candidates and the closed loop; Supplement VI."""

    wrist_view_m: ClassVar[LengthInMetres] = LengthInMetres()
    standoff_m: ClassVar[LengthInMetres] = LengthInMetres()
    correction_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    commit_m: ClassVar[LengthInMetres] = LengthInMetres()
    look_m: ClassVar[LengthInMetres] = LengthInMetres()
    another_m: ClassVar[LengthInMetres] = LengthInMetres()
    regrasp_lever_m: ClassVar[LengthInMetres] = LengthInMetres()
    regrasp_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    smoothing_m: ClassVar[LengthInMetres] = LengthInMetres()
    avoid_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    slip_m: ClassVar[LengthInMetres] = LengthInMetres()

    candidates: int = Field(128, ge=1, le=4096, description="u, sub clouds of the global phase")
    local_candidates: int = Field(48, ge=1, le=4096, description="u of each step on the way down")
    wrist_views: int = Field(
        2,
        ge=0,
        le=8,
        description="looks of the wrist before the choice; at what depth misses, two for one",
    )
    wrist_view_rg: float = Field(
        11.2, gt=2.0, le=80.0, description="pad above what it looks at [r_G]"
    )
    tilt_max_rad: float = Field(
        math.radians(50), ge=0, lt=math.pi / 2, description="approach off the vertical [rad]"
    )
    rate_hz: float = Field(15.0, gt=0, description="closed-loop rate; Supplement VI: 15 [Hz]")
    approach_max_s: float = Field(
        10.0, gt=0.5, le=120, description="longest way down, corrections and all [s]"
    )
    standoff_rg: float = Field(8.0, gt=0.8, le=40.0, description="where the approach begins [r_G]")
    correction_radius_rg: float = Field(
        0.6, ge=0, description="how far one correction may move the contact [r_G]"
    )
    correction_tilt_rad: float = Field(
        0.3, gt=0, le=math.pi, description="how far one correction may turn the approach [rad]"
    )
    commit_rg: float = Field(
        1.2, ge=0, description="this near to the contact nothing is corrected any more [r_G]"
    )
    look_rg: float = Field(
        2.4,
        gt=0,
        description="radius looked at around the aim: the pad and a correction [r_G]",
    )
    another_rg: float = Field(
        1.2,
        ge=0,
        description="another place is at least so far from each given up in the attempt [r_G]",
    )
    retargets: int = Field(
        3, ge=0, description="how often another candidate may be taken after a closer look"
    )
    retarget_gain: float = Field(
        0.1, ge=0, le=1, description="what q-hat another must promise more for that [1]"
    )
    correction_gain: float = Field(
        0.1, ge=0, le=1, description="rise of q-hat that a correction must promise [1]"
    )
    regrasps: int = Field(
        2, ge=0, description="how often an attempt grasps elsewhere what did not hold in the tug"
    )
    regrasp_quality: float = Field(
        0.0, ge=0, le=1, description="least q-hat of another place after a seal that failed [1]"
    )
    regrasp_lever_rg: float = Field(
        0.6, ge=0, description="lever felt in the tug from which the centre is aimed at [r_G]"
    )
    regrasp_radius_rg: float = Field(
        1.0, gt=0, description="how near to the load's centre a regrasp is sought [r_G]"
    )
    new_choices: int = Field(
        2, ge=0, description="how often all is chosen anew where nothing is left near the aim"
    )
    smoothing_rg: float = Field(
        0.28, ge=0, description="q-hat is averaged over neighbours this near [r_G]"
    )
    avoid_radius_rg: float = Field(
        0.8,
        ge=0,
        description="no second try this near to a failed one while there is another [r_G]",
    )
    travel_m_s: float = Field(0.8, gt=0, le=3, description="speed in free space [m/s]")
    speed_m_s: float = Field(0.25, gt=0, le=2, description="speed of approach and lift [m/s]")
    acceleration_m_s2: float = Field(3.0, gt=0, le=50, description="of every motion [m/s2]")
    force_limit_n: float = Field(
        15.0, gt=0, description="contact force that stops the approach [N]"
    )
    tension_min_n: float = Field(
        0.003, gt=0, description="least pull on the base that tells a held object: 0.3 g [N]"
    )
    slip_rg: float = Field(
        0.32, gt=0, description="shift of the load's line in one step that is a slip [r_G]"
    )
    trim_max_rad: float = Field(
        math.radians(12), ge=0, lt=1, description="most the lift may tilt to lessen moments [rad]"
    )


class EvaluateConfig(Section):
    """Closed-loop evaluation on the test clutters."""

    robot: RobotName = Field("floating", description="a gripper alone, or on a KUKA LBR iiwa 14")
    segmentation: Literal["none", "ideal"] = Field(
        "none", description="what tells objects apart by colour; 'ideal': the truth, pixel by pixel"
    )
    policies: tuple[PolicyName, ...] = Field(
        ("closed-loop", "open-loop", "geometric"), min_length=1, description="the first is judged"
    )
    attempts_per_clutter: int = Field(
        15, ge=1, description="attempts before a clutter is given up as not cleared"
    )
    failures_per_clutter: int = Field(5, ge=1, description="failures in a row that end a clutter")
    suction: SuctionConfig = SuctionConfig()
    lift: LiftConfig = LiftConfig()
    hand: HandConfig = HandConfig()
    arm: ArmConfig = ArmConfig()
    policy: PolicyConfig = PolicyConfig()


class RecordingConfig(Section):
    """How much of a stage is shown; recordings are samples, artifacts are whole.

    The bounds keep a recording under 200 MB, by what one item of each kind takes at most.
    """

    objects: int = Field(60, ge=1, le=400, description="objects shown; up to 0.4 MB each")
    scenes: int = Field(40, ge=1, le=100, description="clutters shown; some 2 MB, three cameras")
    grasps: int = Field(60, ge=1, le=800, description="grasps shown; some 0.2 MB each")
    clouds: int = Field(100, ge=1, le=5000, description="clouds shown; some 0.02 MB each")
    attempts: int = Field(60, ge=1, le=200, description="attempts filmed; some 0.8 MB each")
