"""[evaluate.policy]: candidates, the closed loop, and the geometric picker; Supplement VI."""

import math
from typing import ClassVar, Self

from pydantic import Field, model_validator

from pipeline.config.section import LengthInMetres, ScaledSection


class MotionConfig(ScaledSection):
    """How the velocity of a moving object is measured from two pictures."""

    cell_m: ClassVar[LengthInMetres] = LengthInMetres()
    still_m: ClassVar[LengthInMetres] = LengthInMetres()

    cell_rg: float = Field(0.08, gt=0, description="cell of the height maps compared [r_G]")

    @model_validator(mode="after")
    def _refreshes_within_reach(self) -> Self:
        if self.refresh_cells > self.reach_cells:
            raise ValueError("refresh_cells must not exceed reach_cells: no shift is that long")
        return self

    reach_cells: int = Field(20, ge=1, le=200, description="longest shift that is looked for")
    refresh_cells: int = Field(
        12, ge=1, le=200, description="shift after which the earlier picture is replaced"
    )
    overlap_min: float = Field(
        0.4, gt=0, le=1, description="share of the earlier map that a shift must leave in view [1]"
    )
    still_rg: float = Field(
        0.08,
        ge=0,
        description="a shift is known to about half a cell: less than this is standing still [r_G]",
    )
    explained_min: float = Field(
        0.03,
        ge=0,
        le=1,
        description="share of the squared heights that a shift must explain: on an even surface "
        "any fits as well [1]",
    )


class UnseenConfig(ScaledSection):
    """Visual hull of an object that colour pictures show and depth images do not."""

    cell_m: ClassVar[LengthInMetres] = LengthInMetres()
    height_max_m: ClassVar[LengthInMetres] = LengthInMetres()
    around_m: ClassVar[LengthInMetres] = LengthInMetres()
    extent_max_m: ClassVar[LengthInMetres] = LengthInMetres()

    fewest_pixels: int = Field(30, ge=1, description="fewer say too little of an outline")
    measured_share: float = Field(
        0.2,
        ge=0,
        le=1,
        description="an object is seen where this share of its pixels lies above the table [1]",
    )
    cell_rg: float = Field(0.16, gt=0, description="cell of the hull [r_G]")
    height_max_rg: float = Field(6.0, gt=0, description="highest that a hull is looked for [r_G]")
    around_rg: float = Field(
        2.4,
        ge=0,
        description="the hull may lean this far over what the outline covers of the table [r_G]",
    )
    extent_max_rg: float = Field(
        40.0,
        gt=0,
        description="what an outline covers of the table, seen nearly level, is cut to this [r_G]",
    )


class PickerConfig(ScaledSection):
    """The geometric picker: the flattest place for the pad among those at the top."""

    band_m: ClassVar[LengthInMetres] = LengthInMetres()
    roughness_m: ClassVar[LengthInMetres] = LengthInMetres()
    fall_m: ClassVar[LengthInMetres] = LengthInMetres()

    band_rg: float = Field(
        0.6, ge=0, description="candidates this far under the highest count as at the top [r_G]"
    )
    roughness_rg: float = Field(
        0.04, gt=0, description="roughness under the pad where flatness has fallen to 1/e [r_G]"
    )
    fall_rg: float = Field(
        4.0, gt=0, description="depth under the highest at which worth has fallen to 1/e [r_G]"
    )


class PolicyConfig(ScaledSection):
    """Candidates and the closed loop; Supplement VI."""

    wrist_view_m: ClassVar[LengthInMetres] = LengthInMetres()
    standoff_m: ClassVar[LengthInMetres] = LengthInMetres()
    correction_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    commit_m: ClassVar[LengthInMetres] = LengthInMetres()
    align_m: ClassVar[LengthInMetres] = LengthInMetres()
    look_m: ClassVar[LengthInMetres] = LengthInMetres()
    another_m: ClassVar[LengthInMetres] = LengthInMetres()
    regrasp_lever_m: ClassVar[LengthInMetres] = LengthInMetres()
    regrasp_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    wide_normal_m: ClassVar[LengthInMetres] = LengthInMetres()
    again_m: ClassVar[LengthInMetres] = LengthInMetres()
    felt_reach_m: ClassVar[LengthInMetres] = LengthInMetres()
    smoothing_m: ClassVar[LengthInMetres] = LengthInMetres()
    avoid_radius_m: ClassVar[LengthInMetres] = LengthInMetres()
    slip_m: ClassVar[LengthInMetres] = LengthInMetres()
    look_apart_m: ClassVar[LengthInMetres] = LengthInMetres()
    voxel_m: ClassVar[LengthInMetres] = LengthInMetres()
    correction_voxel_m: ClassVar[LengthInMetres] = LengthInMetres()
    above_table_m: ClassVar[LengthInMetres] = LengthInMetres()
    regrasp_column_m: ClassVar[LengthInMetres] = LengthInMetres()
    search_m: ClassVar[LengthInMetres] = LengthInMetres()
    retreat_m: ClassVar[LengthInMetres] = LengthInMetres()
    tug_m: ClassVar[LengthInMetres] = LengthInMetres()
    trim_from_m: ClassVar[LengthInMetres] = LengthInMetres()

    candidates: int = Field(128, ge=1, le=4096, description="u, sub clouds of the global phase")
    more_candidates: int = Field(
        384,
        ge=0,
        le=4096,
        description="drawn besides where none of these promises enough_quality: the good places of "
        "a hard scene are small, or steep",
    )
    enough_quality: float = Field(
        0.5, ge=0, le=1, description="q-hat from which a first choice is good enough [1]"
    )
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
    steepest_rad: float = Field(
        math.radians(75),
        ge=0,
        lt=math.pi / 2,
        description="the same of more_candidates, and of what counts as liftable: a gripper 8 r_G "
        "long then still stands over the table [rad]",
    )
    wide_normal_rg: float = Field(
        1.0,
        gt=0,
        description="of half of more_candidates the normal is the mean over this radius, the "
        "pad's: studs and edges turn the normal of a small neighbourhood away [r_G]",
    )
    lean_rad: float = Field(
        math.radians(20),
        ge=0,
        lt=math.pi / 4,
        description="a wall so much steeper than steepest_rad is approached at that, where "
        "more_candidates are drawn: a soft pad bends [rad]",
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
    align_rg: float = Field(
        0.04,
        gt=0,
        description="the pad goes down along the approach's axis where it is this near to it [r_G]",
    )
    align_rad: float = Field(
        0.02, gt=0, le=1, description="and the axes differ by less than this [rad]"
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
    analytic_share: float = Field(
        0.0,
        ge=0,
        le=1,
        description="share of the analytic baseline in the q-hat by which policies choose; the "
        "rest is the network's [1]",
    )
    correction_gain: float = Field(
        0.1, ge=0, le=1, description="rise of q-hat that a correction must promise [1]"
    )
    regrasps: int = Field(
        2, ge=0, description="how often an attempt of any policy seals again what the tug lost"
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
    again_rg: float = Field(
        0.3, ge=0, description="no other seal is tried nearer to one that failed and was felt [r_G]"
    )
    again_rad: float = Field(
        0.2, ge=0, le=math.pi, description="unless its approach differs by more than this [rad]"
    )
    felt_reach_rg: float = Field(
        0.6,
        gt=0,
        description="how far the vacuum felt at a seal tells of others: its weight has fallen to "
        "exp(-1/2) there [r_G]",
    )
    felt_reach_rad: float = Field(
        0.35, gt=0, le=math.pi, description="the same over the angle between approaches [rad]"
    )
    felt_error: float = Field(
        0.3,
        gt=0,
        description="error of ln(vacuum felt, squared) as a measure of the seal [1]",
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
    contact_sigmas: float = Field(
        3.0, ge=0, description="a touch is at least so many spreads of a force that is read [1]"
    )
    tension_sigmas: float = Field(
        1.0, ge=0, description="a pull is at least so many spreads of a force that is read [1]"
    )
    vacuum_min: float = Field(
        0.005,
        gt=0,
        le=1,
        description="least vacuum over the pump's greatest that tells a held object, where the "
        "vacuum is measured [1]",
    )
    vacuum_sigmas: float = Field(
        3.0, ge=0, description="and it is at least so many spreads of a vacuum that is read [1]"
    )
    loss_readings: int = Field(
        4,
        ge=1,
        description="readings in a row that show no object before it counts as lost, and readings "
        "that the vacuum is the mean of where one is in doubt",
    )
    trim_sigmas: float = Field(
        2.0, ge=0, description="a moment that the lift tilts for is at least so many spreads [1]"
    )
    slip_rg: float = Field(
        0.32, gt=0, description="shift of the load's line in one step that is a slip [r_G]"
    )
    trim_max_rad: float = Field(
        math.radians(12), ge=0, lt=1, description="most the lift may tilt to lessen moments [rad]"
    )
    voxel_rg: float = Field(
        0.12, gt=0, description="points of one cube of this side become their mean [r_G]"
    )
    correction_voxel_rg: float = Field(
        0.08, gt=0, description="the same of the one picture that corrects an aim [r_G]"
    )
    above_table_rg: float = Field(
        0.24, ge=0, description="what is measured lower may be the table [r_G]"
    )
    look_apart_rg: float = Field(
        4.8, ge=0, description="a second look nearer than this would show the same again [r_G]"
    )
    shown_share: float = Field(
        0.9, gt=0, le=1, description="of look_rg, what a picture is sure to show [1]"
    )
    smoothing_tilt_rad: float = Field(
        math.acos(0.95),
        gt=0,
        le=math.pi,
        description="neighbours whose q-hat is averaged approach within this angle [rad]",
    )
    regrasp_column_rg: float = Field(
        0.8, gt=0, description="what is this near to the load's vertical line is on it [r_G]"
    )
    regrasp_nearer: float = Field(
        0.7, gt=0, le=1, description="most of the old lever that a regrasp may have [1]"
    )
    search_rg: float = Field(
        2.4, ge=0, description="past the expected contact the pad goes on at most so far [r_G]"
    )
    retreat_rg: float = Field(2.0, gt=0, description="way back after a failed approach [r_G]")
    tug_rg: float = Field(
        0.4, gt=0, description="first part of the lift, in which a seal shows its pull [r_G]"
    )
    lift_share: float = Field(
        1.3, ge=1, le=4, description="height that the lift aims at, over the one that counts [1]"
    )
    slip_speed_share: float = Field(
        0.5, gt=0, le=1, description="of speed_m_s, what the lift goes on with after a slip [1]"
    )
    trim_from_rg: float = Field(
        1.2, ge=0, description="lift from which the pose is trimmed: clear of neighbours [r_G]"
    )
    contact_n: float = Field(0.5, gt=0, description="push on the pad that is a touch [N]")
    trim_step_rad: float = Field(0.06, gt=0, description="most that one control step trims [rad]")
    trim_lever_m: float = Field(
        0.25, gt=0, description="from the base to what hangs on it, about [m]"
    )
    trim_moment_nm: float = Field(0.005, ge=0, description="less is not worth a tilt [N m]")
    motion: MotionConfig = MotionConfig()

    @model_validator(mode="after")
    def _steepest_is_steeper(self) -> Self:
        if self.steepest_rad < self.tilt_max_rad:
            raise ValueError("steepest_rad must not be less than tilt_max_rad")
        return self

    @model_validator(mode="after")
    def _approach_has_a_way(self) -> Self:
        if self.commit_rg >= self.standoff_rg:
            raise ValueError("commit_rg must be less than standoff_rg, or nothing is corrected")
        return self

    unseen: UnseenConfig = UnseenConfig()
    picker: PickerConfig = PickerConfig()
