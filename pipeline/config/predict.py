"""[predict]: real pictures in, ranked grasps out."""

import math
from typing import Self

from pydantic import Field, model_validator

from pipeline.config.section import Section


class SupportConfig(Section):
    """How the table, or the floor and walls of a bin, are found in a picture."""

    tolerance: float = Field(
        0.008,
        gt=0,
        lt=0.1,
        description="distance from a plane that still lies on it, as a share of the distance from "
        "the camera: consumer depth cameras err by 2 to 5 mm at 0.6 m [1]",
    )
    smallest_share: float = Field(
        0.01, gt=0, le=1, description="least share of the points that makes a plane, a wall [1]"
    )
    support_share: float = Field(
        0.04, gt=0, le=1, description="least share of the points that makes a support [1]"
    )
    below_max_share: float = Field(
        0.1, ge=0, le=1, description="of all points, how many may lie under the support [1]"
    )
    up_known_rad: float = Field(
        math.radians(12), gt=0, le=math.pi / 2, description="the support's tilt, pose known [rad]"
    )
    up_guessed_rad: float = Field(
        math.radians(50),
        gt=0,
        le=math.pi / 2,
        description="angle of the support to the guess of up: a camera that looks 5 to 90 degrees "
        "down [rad]",
    )
    wall_lean_rad: float = Field(
        math.radians(30), ge=0, lt=math.pi / 2, description="lean of a wall off the upright [rad]"
    )
    wall_inner_share: float = Field(
        0.6, ge=0.5, le=1, description="share of the points on a wall's inner side [1]"
    )
    wall_span_share: float = Field(
        0.5, gt=0, le=1, description="length of a wall over that of all that was measured [1]"
    )
    wall_margin_m: float = Field(
        0.012, ge=0, description="what lies this near to a wall belongs to it [m]"
    )
    rounding_m: float = Field(
        0.05,
        ge=0,
        description="a bin's floor passes into its walls, and walls into each other, with a radius "
        "of at most so much [m]",
    )
    bend_seen_share: float = Field(
        0.5,
        ge=0,
        le=1,
        description="of the support's outline, how much must show floor to tell how it is bent [1]",
    )
    rim_m: float = Field(
        0.035,
        ge=0,
        description="a bin's rim is at most so wide, and its height is known to within so much [m]",
    )
    piece_gap_m: float = Field(
        0.015, gt=0, description="a gap this wide parts the support, as between two bins [m]"
    )
    outline_margin_m: float = Field(
        0.01, ge=0, description="objects may stand out so far over the support's edge [m]"
    )
    height_m: float | None = Field(
        None, description="height of a level support in the world, where it is known [m]"
    )


class TrialConfig(Section):
    """How `make real` checks the best grasp of real frames."""

    tilt_max_rad: float = Field(
        math.radians(100),
        gt=0,
        le=math.pi,
        description="approach off the vertical: frames of single objects are seen from the side "
        "[rad]",
    )
    repeats: int = Field(3, ge=1, le=100, description="draws of new contacts, and of lost pixels")
    compared: int = Field(
        5, ge=1, le=100, description="of the best grasps, how many are looked for again"
    )
    lost_share: float = Field(0.2, ge=0, lt=1, description="of the pixels, how many are lost [1]")
    edge_clear_share: float = Field(
        0.5, gt=0, le=2, description="an edge is near within so much of the pad's radius [1]"
    )
    edge_jump_m: float = Field(
        0.01, gt=0, description="the surface is where it lies this near to the pad's plane [m]"
    )
    edge_share_max: float = Field(
        0.1,
        ge=0,
        lt=1,
        description="of the near pixels, how many may be empty, beside the mask or off the plane "
        "[1]",
    )


class LiveConfig(Section):
    """How `make live` answers every picture of a stream."""

    every_px: int = Field(
        2, ge=1, le=16, description="of so many pixels a side one is in the clouds that are ranked"
    )
    cloud_every_px: int = Field(
        3, ge=1, le=16, description="the same of contacts, and of what the hand must not meet"
    )
    candidates: int = Field(96, ge=1, le=4096, description="contacts that are tried a picture")
    top: int = Field(5, ge=1, le=100, description="grasps that are given out a picture")
    support_kept_share: float = Field(
        0.5,
        ge=0,
        le=1,
        description="the support stays where at least so much of a picture lies on it as when it "
        "was found [1]",
    )


class PredictConfig(Section):
    """From a real picture to ranked grasps."""

    candidates: int = Field(512, ge=1, le=8192, description="contacts that are tried a picture")
    closer_places: int = Field(
        12, ge=0, le=256, description="of the best places, how many are looked at more closely"
    )
    closer_contacts: int = Field(
        24, ge=1, le=256, description="contacts that are tried around each of them"
    )
    poses_agree_m: float = Field(
        0.02,
        gt=0,
        description="frames are merged where their supports lie no farther apart [m]",
    )
    speck_share: float = Field(
        0.1,
        ge=0,
        le=1,
        description="a piece that shows less than this share of the pad's area is noise [1]",
    )
    top: int = Field(20, ge=1, le=1000, description="grasps that are given out")
    apart_m: float = Field(
        0.02,
        ge=0,
        description="non-maximum suppression: grasps are at least so far apart; SuctionNet [m]",
    )
    tilt_max_rad: float = Field(
        math.radians(50),
        gt=0,
        le=math.pi,
        description="approach off the vertical; over 90 degrees from the side [rad]",
    )
    above_support_m: float = Field(
        0.006, ge=0, description="what lies lower may be the support itself [m]"
    )
    above_support_share: float = Field(
        0.012,
        ge=0,
        description="the same as a share of the distance from the camera, whichever is more [1]",
    )
    quality_min: float = Field(
        0.69,
        ge=0,
        le=1,
        description="under this q-hat no grasp is called good; `make calibrate` chose it for the "
        "released network [1]",
    )
    good_quality: float = Field(
        0.5, gt=0, lt=1, description="make calibrate: a grasp is good from this q on [1]"
    )
    good_probability: float = Field(
        0.8,
        gt=0,
        lt=1,
        description="make calibrate: of the grasps at quality_min, how many are good [1]",
    )
    support: SupportConfig = SupportConfig()
    trial: TrialConfig = TrialConfig()
    live: LiveConfig = LiveConfig()

    @model_validator(mode="after")
    def _top_are_among_the_candidates(self) -> Self:
        if self.top > self.candidates:
            raise ValueError("top must not exceed candidates")
        return self
