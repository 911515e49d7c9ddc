"""The configuration of the scenes and grasps that the referee judges."""

from pipeline.config.scenes import ClutterCounts, ScenesConfig
from pipeline.config.tree import RunConfig


def judged_config(config: RunConfig) -> RunConfig:
    """A run's configuration for a run within it: all meshes, as far as levels have objects.

    As many clutters and labels as [agreement] wants; all levels, none for want of objects refused;
    no objects but those of the mesh folder, and each of them.
    """
    some = config.agreement.clutters_per_level
    counts = ClutterCounts(train=some, val=(some + 1) // 2, test=some)
    families, masses = (
        f"../{name}" if name else "" for name in (config.split.families, config.objects.masses)
    )  # beside the run's own run.toml
    alone = {
        "limit": 0,
        "embedded_in_training": False,
        "stretched_copies": 0,
        "masses": masses,
    }
    scenes = {
        "clutters_per_level": counts,
        "levels": ScenesConfig().levels,
        "without_objects": "leave out",
    }
    return config.model_copy(
        update={
            "objects": config.objects.model_copy(update=alone),
            "split": config.split.model_copy(update={"families": families}),
            "scenes": config.scenes.model_copy(update=scenes),
            "grasps": config.grasps.model_copy(update={"count": config.agreement.labelled}),
        }
    )
