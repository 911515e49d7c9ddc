"""Whether a run may learn from the samples of other runs: what it holds out, none of them knows."""

from collections.abc import Sequence
from pathlib import Path

from pipeline.artifacts import file_sha256, read_provenance
from pipeline.config import RunConfig, load_run_config
from pipeline.errors import ArtifactError, ConfigError
from pipeline.execution.run_folder import RunFolder
from pipeline.geometry.apart import check_apart
from pipeline.messages.objects import read_objects


def check_further_runs(objects: Path, config: RunConfig, further: Sequence[RunFolder]) -> None:
    """Hold that each further run's labels mean the same, and that none knows what is held out.

    Parameters
    ----------
    objects
        This run's objects.
    config
        This run's configuration.
    further
        The other runs.

    Raises
    ------
    ConfigError
        One has another gripper, or learns from what this run holds out or from something like it;
        the message names run and objects.
    ArtifactError
        One's samples are not of the objects that lie beside them.
    """
    held_out = [item for item, split in read_objects(objects).values() if split != "train"]
    threshold = config.split.family_threshold
    for run in further:
        name = run.path.resolve().name
        there = load_run_config(run.config) if run.config.is_file() else RunConfig()
        if there.gripper != config.gripper:
            raise ConfigError(
                f"Run {name}, which train.further_runs names, has another [gripper], so its labels "
                "mean something else",
                "Name runs of the same gripper",
            )
        check_made_of_its_objects(run)
        known = read_objects(run.artifact("objects"))
        check_apart(held_out, known, threshold, name, there.split.family_threshold)


def check_made_of_its_objects(run: RunFolder) -> None:
    """Raise ArtifactError where a run's samples are not of the objects and grasps beside them."""
    for made, of in (("shards", "grasps"), ("grasps", "objects")):
        recorded = {one.path: one.sha256 for one in read_provenance(run.artifact(made)).inputs}
        source = run.artifact(of)
        if not source.is_file() or recorded.get(source.name) != file_sha256(source):
            raise ArtifactError(
                f"{run.artifact(made)} is not made from the {of}.mcap beside it, so what it learns "
                "from is not known",
                f"Make it anew: make dataset RUN={run.path.resolve().name}, with the same MESH_DIR",
            )
