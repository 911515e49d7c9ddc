"""The configuration of the scenes and grasps that the referee judges."""

from pipeline.config.scenes import ClutterCounts
from pipeline.config.tree import RunConfig


def judged_config(config: RunConfig) -> RunConfig:
    """A run's configuration with as many clutters and labels as [agreement] wants."""
    some = config.agreement.clutters_per_level
    counts = ClutterCounts(train=some, val=(some + 1) // 2, test=some)
    return config.model_copy(
        update={
            "scenes": config.scenes.model_copy(update={"clutters_per_level": counts}),
            "grasps": config.grasps.model_copy(update={"count": config.agreement.labelled}),
        }
    )
