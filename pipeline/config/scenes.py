"""[scenes]: clutter of the nine levels and how it comes to rest."""

from typing import Self

from pydantic import Field, model_validator

from pipeline.config.section import Section


class ClutterCounts(Section):
    """Clutters built per level, by the split their objects come from."""

    train: int = Field(3, ge=0)
    val: int = Field(1, ge=0)
    test: int = Field(1, ge=0, description="also the clutters of the closed-loop evaluation")


class ScenesConfig(Section):
    """Clutter scenes of Table II and how they come to rest."""

    levels: tuple[int, ...] = Field(
        (1, 2, 3, 4, 5, 6, 7, 8, 9), min_length=1, description="clutter levels; Table II"
    )
    clutters_per_level: ClutterCounts = ClutterCounts()
    objects_per_clutter: int = Field(10, ge=1, le=50, description="Supplement V: 10")
    isolated_gap_min_m: float = Field(0.05, gt=0, description="Supplement V: 5 cm [m]")
    multiple_gap_max_m: float = Field(0.01, gt=0, description="Supplement V: 1 cm [m]")
    placement_attempts: int = Field(60, ge=1, description="tries at one clutter before giving up")
    workspace_side_m: float = Field(
        0.85, gt=0.1, le=5, description="side of the square that objects are placed in [m]"
    )
    touch_gap_max_m: float = Field(
        0.002, gt=0, description="stacked objects this near touch, on the true meshes [m]"
    )
    sink_max_m: float = Field(0.001, gt=0, description="deepest allowed interpenetration [m]")
    table_side_m: float = Field(1.2, gt=0.2, le=5, description="side of the square table [m]")
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
        if self.workspace_side_m > self.table_side_m:
            raise ValueError("workspace_side_m must not exceed table_side_m")
        return self
