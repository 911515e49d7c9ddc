"""[scenes]: clutter of the nine levels and how it comes to rest."""

from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from pipeline.config.section import LengthInMetres, ScaledSection, Section


class ClutterCounts(Section):
    """Clutters built per level, by the split their objects come from."""

    train: int = Field(3, ge=1, description="clutters a level of training objects")
    val: int = Field(1, ge=1, description="clutters a level of validation objects")
    test: int = Field(1, ge=1, description="also the clutters of the closed-loop evaluation")


class ScenesConfig(ScaledSection):
    """Clutter scenes of Table II and how they come to rest."""

    workspace_side_m: ClassVar[LengthInMetres] = LengthInMetres()
    table_side_m: ClassVar[LengthInMetres] = LengthInMetres()

    levels: tuple[int, ...] = Field(
        (1, 2, 3, 4, 5, 6, 7, 8, 9), min_length=1, description="clutter levels; Table II"
    )
    clutters_per_level: ClutterCounts = ClutterCounts()
    splits: tuple[Literal["train", "val", "test"], ...] = Field(
        ("train", "val", "test"), min_length=1, description="splits that clutters are built of"
    )
    impossible: Literal["refused", "left out"] = Field(
        "refused",
        description="what becomes of a run with a clutter, or of a clutter, that cannot "
        "be built of the objects there are",
    )
    # Whoever draws a run's seed anew, or chooses among seeds, meets the same test clutters.
    test_seed: int = Field(
        20261128, ge=0, lt=2**63, description="of the test clutters, whatever the run's seed"
    )
    objects_per_clutter: int = Field(10, ge=1, le=50, description="Supplement V: 10")
    isolated_gap_min_m: float = Field(0.05, gt=0, description="Supplement V: 5 cm [m]")
    multiple_gap_max_m: float = Field(0.01, gt=0, description="Supplement V: 1 cm [m]")
    placement_attempts: int = Field(60, ge=1, description="tries at one clutter before giving up")
    workspace_side_rg: float = Field(
        34.0, gt=4.0, le=200.0, description="side of the square that objects are placed in [r_G]"
    )
    touch_gap_max_m: float = Field(
        0.002, gt=0, description="stacked objects this near touch, on the true meshes [m]"
    )
    sink_max_m: float = Field(0.001, gt=0, description="deepest allowed interpenetration [m]")
    table_side_rg: float = Field(
        48.0, gt=8.0, le=200.0, description="side of the square table [r_G]"
    )
    friction: float = Field(0.5, ge=0, le=2, description="object-object and object-table; mu [1]")
    timestep_s: float = Field(1 / 240, gt=0, le=0.02, description="physics step [s]")
    settle_linear_m_s: float = Field(0.005, gt=0, description="at rest below this speed [m/s]")
    settle_angular_rad_s: float = Field(0.1, gt=0, description="at rest below this rate [rad/s]")
    settle_hold_s: float = Field(0.25, gt=0, description="time the bounds must hold [s]")
    settle_max_s: float = Field(12.0, gt=0, description="simulated time before giving up [s]")

    @model_validator(mode="after")
    def _levels_exist(self) -> Self:
        unknown = [level for level in self.levels if not 1 <= level <= 9]
        if unknown:
            raise ValueError(f"levels go from 1 to 9 (Table II), got {unknown}")
        if self.workspace_side_rg > self.table_side_rg:
            raise ValueError("workspace_side_rg must not exceed table_side_rg")
        return self
