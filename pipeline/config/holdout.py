"""[holdout]: the clutters and grasps of unseen meshes on which a given network is tested."""

from pydantic import Field

from pipeline.config.evaluation import PolicyName
from pipeline.config.section import Section


class HoldoutConfig(Section):
    """Scenes, labels and attempts of `make holdout`; what is not named here is as in the run."""

    levels: tuple[int, ...] = Field(
        (1, 2, 3, 4, 5, 6, 7, 8, 9),
        min_length=1,
        description="clutter levels, Table II; those that the meshes cannot make are left out",
    )
    clutters_per_level: int = Field(
        2, ge=1, description="clutters of each level that the policies empty"
    )
    labelled_clutters_per_level: int = Field(
        10,
        ge=1,
        description="clutters of each level whose grasps are labelled, the emptied ones among "
        "them: by two a level, the mean over objects strays by 0.003 with the clutters drawn",
    )
    placement_attempts: int = Field(
        20, ge=1, description="tries at one clutter before it is left out"
    )
    labelled: int = Field(45_000, ge=1, description="grasps labelled, over all clutters")
    policies: tuple[PolicyName, ...] = Field(
        ("closed-loop",), min_length=1, description="policies that empty the clutters"
    )
    ceiling_poses: int = Field(
        0,
        ge=0,
        le=100_000,
        description="evaluate.ceiling.poses of these clutters: what of the meshes can be lifted "
        "at all, at several times the time; 0: not told",
    )
    resamples: int = Field(
        2000, ge=100, description="bootstrap resamples of the objects, for the intervals"
    )
    baseline_grasps: int = Field(
        1000, ge=0, description="of the grasps, those that the released baseline is asked for too"
    )
    shown: int = Field(
        24, ge=1, le=200, description="worst clouds of each object in the recording; 0.02 MB each"
    )
