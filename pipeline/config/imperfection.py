"""[evaluate.imperfection]: the errors of a real robot, and one factor over all of them.

A figure is a standard deviation where its description does not say otherwise. What belongs to a
calibration is drawn once a clutter and held; noise is drawn anew for every reading. Every figure is
multiplied by `scale`. What is said to be «as remembered» was written down from memory of a data
sheet and not held against it: look it up for your arm. Beside it stands what users of such arms
published: what an iiwa tells of its own wrench (github.com/IFL-CAMP/iiwa_stack, issue 209), and
what a Franka arm that touches nothing reads (github.com/frankarobotics/franka_ros, issue 404).
"""

import math
from typing import Literal

from pydantic import Field, field_validator

from pipeline.config.section import Section

PolicyName = Literal[
    "closed-loop", "network", "analytic", "uncorrected", "one-seal", "open-loop", "geometric"
]


class ImperfectionConfig(Section):
    """What a policy measures, and when it learns of it, differs from what is true by these."""

    scale: float = Field(
        1.0, ge=0, le=10, description="factor over all of this section; 0 is a perfect robot [1]"
    )
    force_bias_n: float = Field(
        4.0,
        ge=0,
        description="offset of each force at the base before the wrench is tared: two sigma are "
        "2 % of the 320 N m of iiwa 14's second joint, at 0.8 m; KUKA's 2 % as remembered. An iiwa "
        "calls itself inaccurate by 2.3 to 3.0 N, a Franka arm in free air reads 0.4 to 1.7 N [N]",
    )
    moment_bias_nm: float = Field(
        0.4,
        ge=0,
        description="the same of each moment: two sigma are 2 % of the 40 N m of the last two "
        "joints; KUKA's 2 % as remembered. An iiwa calls itself inaccurate by 0.8 to 1.0 N m, a "
        "Franka arm in free air reads up to 0.45 N m [N m]",
    )
    force_tare_n: float = Field(
        0.15,
        ge=0,
        description="what taring leaves of it: repeatability of another arm with seven torque "
        "sensors, Franka Research 3's data sheet as remembered [N]",
    )
    moment_tare_nm: float = Field(
        0.05,
        ge=0,
        description="the same of each moment; Franka Research 3's data sheet as remembered [N m]",
    )
    force_noise_n: float = Field(
        0.035,
        ge=0,
        description="noise of each force in a reading, RMS; Franka Research 3's data sheet as "
        "remembered. Three readings in a row of a Franka arm differ by 0.01 to 0.02 N [N]",
    )
    moment_noise_nm: float = Field(
        0.005,
        ge=0,
        description="noise of each moment in a reading, RMS; Franka Research 3's data sheet as "
        "remembered. Three readings in a row of a Franka arm differ by 0.003 to 0.012 N m [N m]",
    )
    vacuum_noise: float = Field(
        0.005,
        ge=0,
        le=1,
        description="noise of the vacuum, the mean of a control period, over the pump's greatest: "
        "estimate, 0.25 % of a sensor of 25 kPa that is zeroed in free air, at a fan of 12 kPa [1]",
    )
    hand_eye_m: float = Field(
        0.001,
        ge=0,
        description="place of the wrist's camera along each axis, held against its calibration: "
        "millimetres for larger robots, Zivid's guide to hand-eye residuals [m]",
    )
    hand_eye_rad: float = Field(
        math.radians(0.2),
        ge=0,
        description="its turn about each axis: between 0.1 deg of a good calibration and 0.8 deg "
        "of a poor one in the same guide [rad]",
    )
    camera_m: float = Field(
        0.001, ge=0, description="place of each camera beside the table, as hand_eye_m [m]"
    )
    camera_rad: float = Field(
        math.radians(0.2), ge=0, description="its turn about each axis, as hand_eye_rad [rad]"
    )
    latency_s: float = Field(
        0.065,
        ge=0,
        le=1,
        description="from exposure to picture, no spread: 60 to 70 ms of depth streams, by "
        "RealSense's maintainers (librealsense 1242) [s]",
    )
    correction_s: float = Field(
        1 / 15,
        ge=0,
        le=1,
        description="from picture to corrected aim, no spread: a period at the 15 Hz of "
        "Supplement VI; the robot goes on meanwhile [s]",
    )
    choice_s: float = Field(
        0.2,
        ge=0,
        le=10,
        description="to rank all candidates, no spread: estimate; the robot waits meanwhile [s]",
    )
    own_margin_m: float = Field(
        0.006,
        ge=0,
        le=0.1,
        description="what is measured this near to the gripper counts as the gripper and is cut "
        "out of pictures, not scaled: two sigma of camera_m and camera_rad at 0.9 m, about [m]",
    )
    curve: tuple[float, ...] = Field(
        (0.0, 1.0, 2.0),
        description="scales at which success is compared beside the contest; () is none [1]",
    )
    curve_clutters: int = Field(1, ge=1, le=100, description="clutters a level for that")
    curve_policies: tuple[PolicyName, ...] = Field(
        ("closed-loop", "open-loop"), min_length=1, description="policies for that"
    )

    @field_validator("curve")
    @classmethod
    def _grows(cls, values: tuple[float, ...]) -> tuple[float, ...]:
        if any(value < 0 for value in values) or list(values) != sorted(set(values)):
            raise ValueError("curve must grow from 0 or more")
        return values

    @property
    def force_error_n(self) -> float:
        """Standard deviation of one force that a tared wrench tells [N]."""
        return self.scale * math.hypot(self.force_tare_n, self.force_noise_n)

    @property
    def vacuum_error(self) -> float:
        """Standard deviation of one vacuum that is read, over the pump's greatest [1]."""
        return self.scale * self.vacuum_noise

    @property
    def moment_error_nm(self) -> float:
        """Standard deviation of one moment that a tared wrench tells [N m]."""
        return self.scale * math.hypot(self.moment_tare_nm, self.moment_noise_nm)

    @property
    def picture_age_s(self) -> float:
        """From exposure to the aim that the picture corrects [s]."""
        return self.scale * (self.latency_s + self.correction_s)
