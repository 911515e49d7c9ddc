"""[evaluate] and [recording]: the closed loop, and what recordings show."""

import math
from typing import Literal

from pydantic import Field

from pipeline.config.section import Section


class SuctionConfig(Section):
    """The vacuum and the joint that carries an object."""

    vacuum_pa: float = Field(
        8000.0, gt=0, le=101_325, description="pressure difference at p = 1 of Eq. (2) [Pa]"
    )
    seal_min: float = Field(0.05, ge=0, le=1, description="least p that closes the joint [1]")


class LiftConfig(Section):
    """When a grasp counts."""

    height_m: float = Field(0.10, gt=0, description="lift that counts [m]")
    hold_s: float = Field(1.0, gt=0, description="time the object must stay up [s]")
    shake_m: float = Field(0.005, ge=0, description="amplitude of the shake while held [m]")
    shake_hz: float = Field(2.0, gt=0, description="frequency of the shake [Hz]")


class PolicyConfig(Section):
    """Candidates and the closed loop; Supplement VI."""

    candidates: int = Field(128, ge=1, le=4096, description="u, sub clouds sampled")
    tilt_max_rad: float = Field(
        math.radians(50), ge=0, lt=math.pi / 2, description="approach off the vertical [rad]"
    )
    rate_hz: float = Field(15.0, gt=0, description="closed-loop rate; Supplement VI: 15 [Hz]")
    corrections: int = Field(3, ge=0, description="re-observations on the way down")
    correction_radius_m: float = Field(
        0.015, ge=0, description="how far a correction may move the contact [m]"
    )
    speed_m_s: float = Field(0.25, gt=0, le=2, description="approach speed [m/s]")
    force_limit_n: float = Field(
        15.0, gt=0, description="contact force that stops the approach [N]"
    )


class EvaluateConfig(Section):
    """Closed-loop evaluation on the test clutters."""

    robot: Literal["floating"] = "floating"
    attempts_per_clutter: int = Field(
        15, ge=1, description="attempts before a clutter is given up as not cleared"
    )
    failures_per_clutter: int = Field(5, ge=1, description="failures in a row that end a clutter")
    suction: SuctionConfig = SuctionConfig()
    lift: LiftConfig = LiftConfig()
    policy: PolicyConfig = PolicyConfig()


class RecordingConfig(Section):
    """How much of a stage is shown; recordings are samples, artifacts are whole.

    The bounds keep a recording under 200 MB, by what one item of each kind takes at most.
    """

    objects: int = Field(60, ge=1, le=400, description="objects shown; up to 0.4 MB each")
    scenes: int = Field(40, ge=1, le=100, description="clutters shown; some 2 MB, three cameras")
    grasps: int = Field(120, ge=1, le=800, description="grasps shown; some 0.2 MB each")
    clouds: int = Field(100, ge=1, le=5000, description="clouds shown; some 0.02 MB each")
    attempts: int = Field(60, ge=1, le=200, description="attempts filmed; some 0.8 MB each")
