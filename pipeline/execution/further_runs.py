"""Whether a run may learn from the samples of other runs: what it holds out, none of them knows."""

from collections.abc import Sequence
from pathlib import Path

from pipeline.execution.run_folder import RunFolder
from pipeline.geometry.apart import check_apart
from pipeline.messages.objects import read_objects


def check_further_runs(objects: Path, further: Sequence[RunFolder], threshold: float) -> None:
    """Hold that no further run learns from what this run holds out, or from something like it.

    Parameters
    ----------
    objects
        This run's objects.
    further
        The other runs.
    threshold
        ``split.family_threshold``: shapes nearer than this are one family [1].

    Raises
    ------
    ConfigError
        One does; the message names run and objects.
    """
    held_out = [item for item, split in read_objects(objects).values() if split != "train"]
    for run in further:
        known = read_objects(run.artifact("objects"))
        check_apart(held_out, known, threshold, run.path.resolve().name)
