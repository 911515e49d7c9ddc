"""Configuration of a run within a run: of the referee, of a holdout, of folds."""

from pipeline.config.scenes import ClutterCounts, ScenesConfig
from pipeline.config.tree import RunConfig

# Their sections say how many grasps are labelled in all.
SHARED_OUT = {"per_scene": 0, "portions": 1}
# They have no random solids, which a run that trains on no mesh needs.
ANY_MESH = {"meshes_in_training": True}
# What [train] names lies beside the run's own run.toml, and nothing is trained from it here.
FROM_NOTHING = {"start": "", "further_runs": (), "attempts": ()}


def judged_config(config: RunConfig) -> RunConfig:
    """Configuration of the run that `make referee` makes within a run.

    It has the numbers of clutters and labels of [agreement], and all levels; clutters that cannot
    be built are left out. It uses every object of the mesh folder and no others.
    """
    some = config.agreement.clutters_per_level
    counts = ClutterCounts(train=some, val=(some + 1) // 2, test=some)
    families, masses = (
        f"../{name}" if name else "" for name in (config.split.families, config.objects.masses)
    )  # beside the run's own run.toml
    alone = {
        "limit": 0,
        "embedded_in_training": False,
        "random_solids": 0,
        "stretched_copies": 0,
        "masses": masses,
    }
    scenes = {
        "clutters_per_level": counts,
        "levels": ScenesConfig().levels,
        "impossible": "left out",
    }
    return config.model_copy(
        update={
            "objects": config.objects.model_copy(update=alone),
            "split": config.split.model_copy(update={"families": families} | ANY_MESH),
            "scenes": config.scenes.model_copy(update=scenes),
            "grasps": config.grasps.model_copy(
                update={"count": config.agreement.labelled, "noise_draws": 1} | SHARED_OUT
            ),
            "train": config.train.model_copy(update=FROM_NOTHING),
        }
    )


def holdout_config(config: RunConfig) -> RunConfig:
    """A run's configuration with every object in the test split, as [holdout] wants it.

    Settings for the run's own meshes are left out: families, masses, copies, a limit, transparent
    names; and success over the size of the robot's errors, which tells of policies, not of meshes.
    """
    wanted = config.holdout
    made = max(wanted.clutters_per_level, wanted.labelled_clutters_per_level)
    return config.model_copy(
        update={
            "objects": config.objects.model_copy(
                update={
                    "limit": 0,
                    "embedded_in_training": False,
                    "random_solids": 0,
                    "stretched_copies": 0,
                    "transparent": (),
                    "masses": "",
                }
            ),
            "split": config.split.model_copy(
                update={"families": "", "all_in_test": True} | ANY_MESH
            ),
            "scenes": config.scenes.model_copy(
                update={
                    "levels": wanted.levels,
                    "splits": ("test",),
                    "impossible": "left out",
                    "placement_attempts": wanted.placement_attempts,
                    "clutters_per_level": ClutterCounts(test=made),
                }
            ),
            "grasps": config.grasps.model_copy(update={"count": wanted.labelled} | SHARED_OUT),
            "train": config.train.model_copy(update=FROM_NOTHING),
            "evaluate": config.evaluate.model_copy(
                update={
                    "split": "test",
                    "clutters_from": 0,
                    "clutters_per_level": wanted.clutters_per_level,
                    "policies": wanted.policies,
                    "ceiling": config.evaluate.ceiling.model_copy(
                        update={"poses": wanted.ceiling_poses}
                    ),
                    "imperfection": config.evaluate.imperfection.model_copy(update={"curve": ()}),
                }
            ),
        }
    )


def folds_config(config: RunConfig, folds: int) -> RunConfig:
    """A run's configuration for each of so many folds: all its objects make clutters of one split.

    Labels are dealt over the folds. Random solids and stretched copies are left out.
    """
    wanted = config.folds
    families, masses = (
        f"../{name}" if name else "" for name in (config.split.families, config.objects.masses)
    )  # beside the run's own run.toml
    dealt = {"limit": 0, "random_solids": 0, "stretched_copies": 0, "masses": masses}
    return config.model_copy(
        update={
            "objects": config.objects.model_copy(update=dealt),
            "split": config.split.model_copy(
                update={"families": families, "all_in_test": True} | ANY_MESH
            ),
            "scenes": config.scenes.model_copy(
                update={
                    "splits": ("test",),
                    "impossible": "left out",
                    "clutters_per_level": ClutterCounts(test=wanted.clutters_per_level),
                }
            ),
            "grasps": config.grasps.model_copy(
                update={"count": -(-wanted.labelled // folds)} | SHARED_OUT
            ),
            "network": wanted.network,
            "train": config.train.model_copy(update={"epochs": wanted.epochs} | FROM_NOTHING),
        }
    )
