"""[cameras]: the cameras, their viewpoints, and the renderer of their pictures."""

import math
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from pipeline.config.section import LengthInMetres, ScaledSection, Section

DepthSensor = Literal[
    "ideal", "time-of-flight", "lidar", "structured-light", "coded-light", "active-stereo"
]
RendererName = Literal["auto", "sapien", "embree"]


class DepthCameraConfig(ScaledSection):
    """A pinhole depth camera; its sensor decides the noise."""

    width_px: int = Field(ge=16, le=4096, description="width of the depth image")
    height_px: int = Field(ge=16, le=4096, description="height of the depth image")
    vertical_fov_rad: float = Field(gt=0.05, lt=2.8, description="vertical field of view [rad]")
    near_m: float = Field(gt=0, description="nearest measurable depth [m]")
    far_m: float = Field(gt=0, description="farthest measurable depth [m]")
    sensor: DepthSensor = Field(description="noise model of the Disturb step, S-1.15")

    @model_validator(mode="after")
    def _range_is_one(self) -> Self:
        if self.near_m >= self.far_m:
            raise ValueError("near_m must be less than far_m")
        return self


class StaticCameraConfig(DepthCameraConfig):
    """A camera fixed beside the table, looking at its middle; defaults: Kinect v2."""

    distance_m: ClassVar[LengthInMetres] = LengthInMetres()

    width_px: int = Field(512, ge=16, le=4096, description="Kinect v2 depth image: 512")
    height_px: int = Field(424, ge=16, le=4096, description="Kinect v2 depth image: 424")
    vertical_fov_rad: float = Field(
        math.radians(60.0), gt=0.05, lt=2.8, description="Kinect v2: 60 deg [rad]"
    )
    near_m: float = Field(0.5, gt=0, description="nearest measurable depth; Kinect v2: 0.5 [m]")
    far_m: float = Field(4.5, gt=0, description="farthest measurable depth; Kinect v2: 4.5 [m]")
    sensor: DepthSensor = Field("time-of-flight", description="noise model of Disturb, S-1.15")
    distance_rg: float = Field(36.0, gt=2.0, description="from the clutter's centre [r_G]")
    elevations_rad: tuple[float, ...] = Field(
        (1.30,), min_length=1, description="angle above the table, one a viewpoint [rad]"
    )
    azimuths_rad: tuple[float, ...] = Field(
        (0.0,), min_length=1, description="angle about world z, one a viewpoint [rad]"
    )

    @model_validator(mode="after")
    def _table_is_in_range(self) -> Self:
        if not self.near_m < self.distance_m < self.far_m:
            raise ValueError(
                f"distance_rg puts the camera at {self.distance_m:g} m, and it measures from "
                f"near_m = {self.near_m:g} to far_m = {self.far_m:g}"
            )
        return self

    @model_validator(mode="after")
    def _viewpoints_pair_up(self) -> Self:
        if len(self.elevations_rad) != len(self.azimuths_rad):
            raise ValueError("elevations_rad and azimuths_rad need the same length")
        return self


class WristCameraConfig(DepthCameraConfig):
    """The camera beside the gripper, each viewpoint above an object; defaults: RealSense L515."""

    distance_m: ClassVar[LengthInMetres] = LengthInMetres()

    width_px: int = Field(640, ge=16, le=4096, description="L515 depth stream: 640 (VGA mode)")
    height_px: int = Field(480, ge=16, le=4096, description="L515 depth stream: 480 (VGA mode)")
    vertical_fov_rad: float = Field(
        math.radians(55.0), gt=0.05, lt=2.8, description="L515 data sheet: 55 deg [rad]"
    )
    near_m: float = Field(0.25, gt=0, description="nearest measurable depth; L515: 0.25 [m]")
    far_m: float = Field(9.0, gt=0, description="farthest measurable depth; L515: 9 [m]")
    sensor: DepthSensor = Field("lidar", description="noise model of Disturb, S-1.15")
    viewpoints: int = Field(2, ge=0, le=32, description="places the wrist goes to in each scene")
    distance_rg: float = Field(18.0, gt=2.0, description="from the object looked at [r_G]")
    elevation_min_rad: float = Field(
        1.2, gt=0, le=math.pi / 2, description="flattest look at an object [rad]"
    )
    elevation_max_rad: float = Field(
        1.5, gt=0, le=math.pi / 2, description="steepest look at an object [rad]"
    )

    @model_validator(mode="after")
    def _object_is_in_range(self) -> Self:
        if not self.near_m < self.distance_m < self.far_m:
            raise ValueError(
                f"distance_rg puts the camera at {self.distance_m:g} m, and it measures from "
                f"near_m = {self.near_m:g} to far_m = {self.far_m:g}"
            )
        return self

    @model_validator(mode="after")
    def _elevations_are_ordered(self) -> Self:
        if self.elevation_min_rad > self.elevation_max_rad:
            raise ValueError("elevation_min_rad must not exceed elevation_max_rad")
        return self


class CamerasConfig(Section):
    """The cameras of a run and their renderer."""

    renderer: RendererName = Field(
        "auto", description="auto: SAPIEN's where a Vulkan driver is, else Embree rays"
    )
    static: StaticCameraConfig = StaticCameraConfig()
    wrist: WristCameraConfig = WristCameraConfig()
