"""[evaluate] and [recording]: the closed loop, and what recordings show."""

from typing import ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from pipeline.config.imperfection import ImperfectionConfig
from pipeline.config.imperfection import PolicyName as PolicyName
from pipeline.config.policy import PolicyConfig
from pipeline.config.section import LengthInMetres, ScaledSection, Section

RobotName = Literal["floating", "iiwa14"]


class SuctionConfig(Section):
    """The vacuum and the joint that carries an object, for `judge = "label"`."""

    vacuum_pa: float = Field(
        8000.0, gt=0, le=101_325, description="pressure difference at p = 1 of Eq. (2) [Pa]"
    )
    seal_min: float = Field(
        0.05,
        ge=0,
        le=1,
        description="least p that closes the joint; a seal worse than this counts as none [1]",
    )


class LiftConfig(ScaledSection):
    """The lift and the shake that an object must survive for a grasp to count as a success."""

    height_m: ClassVar[LengthInMetres] = LengthInMetres()

    height_rg: float = Field(4.0, gt=0, description="lift that counts [r_G]")
    hold_s: float = Field(1.0, gt=0, description="time the object must stay up [s]")
    shake_m: float = Field(0.005, ge=0, description="amplitude of the shake before that [m]")
    shake_hz: float = Field(2.0, gt=0, description="frequency of the shake [Hz]")
    shake_s: float = Field(0.5, ge=0, description="time of the shake [s]")


class TransportConfig(ScaledSection):
    """What a robot does to an object that it has lifted: there and back, faster each time."""

    way_m: ClassVar[LengthInMetres] = LengthInMetres()

    accelerations_m_s2: tuple[float, ...] = Field(
        (1.0, 3.0, 5.0),
        description="of each time, braking as hard; what falls in any is lost; () is none [m/s2]",
    )
    way_rg: float = Field(
        8.0, gt=0, description="how far to the side; less where the arm cannot [r_G]"
    )
    rest_s: float = Field(0.3, gt=0, description="time of standing still after each time [s]")

    @field_validator("accelerations_m_s2")
    @classmethod
    def _grow(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if any(value <= 0 for value in values) or list(values) != sorted(set(values)):
            raise ValueError("accelerations_m_s2 must grow from over 0")
        return values


class CeilingConfig(Section):
    """The best that could be done: how many poses are tried on each object as it lies."""

    poses: int = Field(
        0, ge=0, le=100_000, description="reachable poses on each object; 0: no ceiling is told"
    )
    judged: int = Field(
        16, ge=1, le=10_000, description="of these, the likeliest by the label, that are judged"
    )
    steps: int = Field(2, ge=0, le=100, description="how often poses near the best are judged")
    nearby: int = Field(9, ge=1, le=1000, description="poses judged in each such step")
    first_that_lifts: bool = Field(
        False,
        description="whether the search ends at the first pose that lifts the object: what can be "
        "lifted is the same, the weight told is then not the greatest",
    )


class HandConfig(ScaledSection):
    """The gripper's rigid part and the camera on it, in GCS: +z from the pad to the flange."""

    length_m: ClassVar[LengthInMetres] = LengthInMetres()
    stem_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    stem_begins_m: ClassVar[LengthInMetres] = LengthInMetres()
    camera_aside_m: ClassVar[LengthInMetres] = LengthInMetres()
    camera_above_m: ClassVar[LengthInMetres] = LengthInMetres()
    camera_focus_m: ClassVar[LengthInMetres] = LengthInMetres()
    margin_m: ClassVar[LengthInMetres] = LengthInMetres()
    home_m: ClassVar[LengthInMetres] = LengthInMetres()

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
    margin_rg: float = Field(
        0.16, ge=0, description="hand and stem keep this far from what was measured [r_G]"
    )
    home_rg: float = Field(24.0, gt=0, description="height at which a floating gripper waits [r_G]")
    friction: float = Field(0.3, ge=0, le=2, description="of stem and hand against objects [1]")
    touch_n: float = Field(
        2.0, ge=0, description="what the pad's spring pushes with when it touches [N]"
    )
    measures_vacuum: bool = Field(
        True,
        description="whether a sensor tells the vacuum at the pad, by which objects too light for "
        "the wrench are felt",
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
    margin_m: float = Field(
        0.01, ge=0, description="links, hand and table keep this far from each other [m]"
    )
    hand_mass_kg: float = Field(0.6, gt=0, description="of the gripper at the flange [kg]")


class PrecisionConfig(Section):
    """Average precision of ranked contacts, and what predictions of them err by; as SuctionNet."""

    clutters_per_level: int = Field(
        2, ge=0, description="clutters of each level, of seen and unseen families each; 0: none"
    )
    contacts: int = Field(
        384, ge=1, le=4096, description="contacts drawn in a scene, as the policy draws them"
    )
    top: int = Field(50, ge=1, description="contacts judged in a scene; SuctionNet: 50")
    most_an_object: int = Field(
        10, ge=1, description="of these, at most so many on an object; SuctionNet: 10"
    )
    apart_m: float = Field(
        0.02, ge=0, description="non-maximum suppression; SuctionNet: 2 cm, whatever the pad [m]"
    )
    thresholds: tuple[float, ...] = Field(
        (0.2, 0.4, 0.6, 0.8),
        min_length=1,
        description="q from which a contact is good; SuctionNet: 0.2 to 0.8 of its own score [1]",
    )
    shown: int = Field(
        6, ge=0, le=50, description="worst clouds kept of a scene, for recording and page; 14 kB"
    )


class EvaluateConfig(Section):
    """Closed-loop evaluation on the clutters of one split."""

    robot: RobotName = Field("floating", description="a gripper alone, or on a KUKA LBR iiwa 14")
    segmentation: Literal["none", "ideal"] = Field(
        "none", description="what tells objects apart by colour; 'ideal': the truth, pixel by pixel"
    )
    judge: Literal["referee", "label"] = Field(
        "referee",
        description="what an object hangs by: what [referee] finds borne, or the label's p and "
        "Eq. (7)-(11) at suction.vacuum_pa",
    )
    split: Literal["test", "val"] = Field(
        "test", description="whose clutters are picked; choices are made on val"
    )
    clutters_from: int = Field(
        0,
        ge=0,
        description="number of the first clutter of each level that is picked: those before it "
        "were looked at while the policy was made",
    )
    clutters_per_level: int = Field(
        0, ge=0, description="clutters of each level that are picked, from that one on; 0: all"
    )
    policies: tuple[PolicyName, ...] = Field(
        ("closed-loop", "analytic", "uncorrected", "one-seal", "open-loop", "geometric"),
        min_length=1,
        description="the first is judged",
    )
    settle_s: float = Field(
        1.5, ge=0, description="time that a clutter comes to rest before the first attempt [s]"
    )
    attempts_per_clutter: int = Field(
        15, ge=1, description="attempts before a clutter is given up as not cleared"
    )
    failures_per_clutter: int = Field(5, ge=1, description="failures in a row that end a clutter")
    seen_every: int = Field(
        2,
        ge=1,
        le=16,
        description="of the pictures that attempts keep, one pixel of so many on each side",
    )
    suction: SuctionConfig = SuctionConfig()
    lift: LiftConfig = LiftConfig()
    transport: TransportConfig = TransportConfig()
    ceiling: CeilingConfig = CeilingConfig()
    hand: HandConfig = HandConfig()
    arm: ArmConfig = ArmConfig()
    policy: PolicyConfig = PolicyConfig()
    imperfection: ImperfectionConfig = ImperfectionConfig()
    precision: PrecisionConfig = PrecisionConfig()

    @model_validator(mode="after")
    def _tug_is_part_of_the_lift(self) -> Self:
        if self.policy.tug_rg > self.lift.height_rg:
            raise ValueError("policy.tug_rg must not exceed lift.height_rg, whose first part it is")
        return self


class RecordingConfig(Section):
    """How many items of a stage its recording shows; the artifact always holds all.

    The bounds keep a recording under 200 MB; they follow from the largest size of an item.
    """

    objects: int = Field(60, ge=1, le=400, description="objects shown; up to 0.4 MB each")
    scenes: int = Field(40, ge=1, le=100, description="clutters shown; some 2 MB, three cameras")
    grasps: int = Field(60, ge=1, le=800, description="grasps shown; some 0.2 MB each")
    clouds: int = Field(100, ge=1, le=5000, description="clouds shown; some 0.02 MB each")
    attempts: int = Field(60, ge=1, le=200, description="attempts filmed; some 0.8 MB each")
