"""[gripper], [grasps] and [sensing]: the pad, the labels, the sub point cloud."""

import math
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from pipeline.config.section import LengthInMetres, ScaledSection, Section

CELL_SIDE = 0.1  # side of a sub cloud's cell in units of r_G: 60 mm in 24 cells over 25 mm

SMALLEST_PAD_M, LARGEST_PAD_M = 0.002, 1.0  # r_G of suction pads, from a needle's to a table's

MOST_VERTICES = 50_000  # a label of such a pad takes seconds; Table I's has 586

SolverName = Literal["structured", "piqp-sparse", "piqp-dense", "clarabel"]


class PadConfig(Section):
    """The soft pad's geometry: Table I."""

    seal_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    altitude_m: ClassVar[LengthInMetres] = LengthInMetres()
    radius_step_m: ClassVar[LengthInMetres] = LengthInMetres()
    distance_step_m: ClassVar[LengthInMetres] = LengthInMetres()
    contact_tolerance_m: ClassVar[LengthInMetres] = LengthInMetres()

    @property
    def r_g_m(self) -> float:
        """r_G, the pad's own radius [m]."""
        return self.radius_m

    seal_radius_rg: float = Field(0.8, gt=0, description="r_v, radius of Reg.V; Table I [r_G]")
    radius_m: float = Field(
        0.025,
        ge=SMALLEST_PAD_M,
        le=LARGEST_PAD_M,
        strict=True,
        description="r_G, radius of the pad; Table I [m]",
    )
    altitude_rg: float = Field(1.2, gt=0, description="H, altitude of the pad; Table I [r_G]")
    rotation_step_rad: float = Field(
        0.045 * math.pi, gt=0, le=math.pi / 2, description="Delta_theta; Table I [rad]"
    )
    radius_step_rg: float = Field(0.08, gt=0, description="Delta_r, upper bound; Table I [r_G]")
    distance_step_rg: float = Field(0.08, gt=0, description="Delta_d; Table I [r_G]")
    contact_tolerance_rg: float = Field(
        0.004, ge=0, description="a vertex this near the surface is in contact; reading.md [r_G]"
    )

    @model_validator(mode="after")
    def _grid_is_fine_enough_and_fits_memory(self) -> Self:
        if self.seal_radius_rg > 1:
            raise ValueError("seal_radius_rg must not exceed 1, which is r_G itself")
        for name in ("distance_step_rg", "contact_tolerance_rg"):
            if getattr(self, name) > self.altitude_rg:
                raise ValueError(f"{name} must not exceed altitude_rg")
        vertices = 2 * math.pi / self.rotation_step_rad / self.radius_step_rg
        if vertices > MOST_VERTICES:
            raise ValueError(
                f"rotation_step_rad and radius_step_rg make a pad of {vertices:.3g} vertices, "
                f"and it may have {MOST_VERTICES}"
            )
        return self


class GripperConfig(Section):
    """Contact physics and the quality QP: Eq. (2)-(14)."""

    pad: PadConfig = PadConfig()
    friction: float = Field(0.5, gt=0, le=2, description="mu of Eq. (3)-(11) [1]")
    weight_spread: float = Field(0.1, ge=0, lt=1, description="sigma_W of Eq. (13) [1]")
    quality_scale: float = Field(
        math.log(100.0), gt=0, description="s of S-1.12; ln 100: a pad holding nothing has q=0.01"
    )
    max_iterations: int = Field(100, ge=1, le=100, description="QP iterations; Supplement III")
    solver: SolverName = Field("structured", description="which solver of the quality QP labels")


class GraspsConfig(ScaledSection):
    """How many grasps, where they are tried, and how they are batched."""

    nearby_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    normal_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    clearance_m: ClassVar[LengthInMetres] = LengthInMetres()

    count: int = Field(
        5000, ge=1, description="labelled grasps wanted in all, shared out among the scenes"
    )
    per_scene: int = Field(
        0, ge=0, description="grasps of a portion of each scene, whatever the count; 0: the count"
    )
    portions: int = Field(
        1,
        ge=1,
        le=1000,
        description="portions of each scene, each drawn and balanced by itself: with more of them "
        "the first stay what they are; needs per_scene",
    )
    oversampling: float = Field(
        3.0, ge=1, le=20, description="candidates labelled per grasp kept, to flatten the labels"
    )
    balance: float = Field(
        0.7, ge=0, le=1, description="0 keeps the proposal's labels, 1 draws a flat histogram"
    )
    normal_share: float = Field(
        0.6, ge=0, le=1, description="share of first proposals along the mean surface normal [1]"
    )
    nearby_share: float = Field(
        0.6, ge=0, lt=1, description="share of candidates proposed near rare labels [1]"
    )
    nearby_radius_rg: float = Field(
        0.16, gt=0, description="step of the contact to a nearby proposal [r_G]"
    )
    nearby_tilt_rad: float = Field(
        0.08, ge=0, description="step of the approach to a nearby proposal [rad]"
    )
    tilt_max_rad: float = Field(
        0.6, ge=0, lt=math.pi / 2, description="largest tilt of the approach off the normal [rad]"
    )
    seen_angle_max_rad: float = Field(
        math.radians(50),
        gt=0,
        le=math.pi / 2,
        description="largest angle at which a camera sees a contact or a tilted approach [rad]",
    )
    normal_radius_rg: float = Field(
        0.4, gt=0, description="surface normal is the mean over this radius [r_G]"
    )
    clearance_rg: float = Field(
        6.0, gt=0, description="height above the contact from which the pad descends [r_G]"
    )
    merged_share: float = Field(
        0.5,
        ge=0,
        le=1,
        description="share of clouds cut from all pictures of the scene, as the global phase does; "
        "the others from one, as on the way down [1]",
    )
    noise_draws: int = Field(
        1,
        ge=1,
        le=64,
        description="clouds measured of each training grasp: the same label under further draws of "
        "the sensors' noise",
    )
    noise_shared_by: int = Field(
        0,
        ge=0,
        description="training grasps of one view that share a draw of the sensors' noise; 0: all "
        "of them, as of one picture",
    )
    samples_per_message: int = Field(256, ge=1, le=8192)

    @model_validator(mode="after")
    def _portions_are_of_a_scene(self) -> Self:
        if self.portions > 1 and not self.per_scene:
            raise ValueError("portions are of per_scene grasps each: give per_scene")
        return self

    def of_scenes(self, scenes: int) -> list[list[int]]:
        """Share out the grasps that are wanted.

        Parameters
        ----------
        scenes
            How many scenes there are.

        Returns
        -------
        Grasps of each portion of each scene.
        """
        if self.per_scene:
            return [[self.per_scene] * self.portions] * scenes
        share, more = divmod(self.count, scenes)
        return [[share + (index < more)] for index in range(scenes)]


class SensingConfig(ScaledSection):
    """From a rendered depth image to the sample's cloud: S-1.13 - S-1.15."""

    grid_side_m: ClassVar[LengthInMetres] = LengthInMetres()
    grid_depth_m: ClassVar[LengthInMetres] = LengthInMetres()
    grid_height_m: ClassVar[LengthInMetres] = LengthInMetres()
    layer_m: ClassVar[LengthInMetres] = LengthInMetres()

    disturbed: bool = Field(True, description="whether the sensors' noise is added; S-1.15")
    grid_cells: int = Field(24, ge=8, le=128, description="cells a side; Supplement III: 24")
    grid_side_rg: float = Field(2.4, gt=0, description="side of the square around the pad [r_G]")
    grid_depth_rg: float = Field(
        1.2, gt=0, description="points farther than this below the contact are left out [r_G]"
    )
    grid_height_rg: float = Field(
        6.0, gt=0, description="points farther than this above the contact are left out [r_G]"
    )
    rounded: bool = Field(
        True,
        description="clouds are kept in steps of r_G / 1024, at half the size; false: half floats",
    )
    layer_rg: float = Field(
        0.2, gt=0, description="a cell holds the mean of its points this near its highest [r_G]"
    )
