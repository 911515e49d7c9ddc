"""A folder that a dataset hub or an archive takes as it is: files, preview, loading examples."""

import shutil
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np

from pipeline.artifacts.publishing import file_sha256, publish_bytes, published
from pipeline.artifacts.sharding import listed_shards
from pipeline.errors import ArtifactError, MachineError
from pipeline.interchange.parquet_shards import write_parquet
from pipeline.interchange.reading import read_shard
from pipeline.network.samples import Samples, join_samples
from pipeline.spread import choose_evenly

PREVIEW = "preview"
SHARDS = "shards"
PREVIEW_SAMPLE_BYTES = 24 * 24 * (3 * 4 + 1)  # at most: a cloud of float32, and its mask

PYTORCH = '''\
"""Samples of a split as PyTorch tensors, by softgrip: pip install softgrip"""
from pathlib import Path
import torch
from pipeline.messages.samples import read_split
train = read_split(Path(__file__).parent / "shards.mcap", "train")
cloud, mask, q = map(torch.tensor, (train.cloud, train.cloud_mask, train.quality))
print(cloud.shape, mask.shape, q.mean())
'''
DATASETS = '''\
"""The Parquet preview by Hugging Face datasets: pip install datasets"""
from pathlib import Path
from datasets import load_dataset
files = {f.stem: str(f) for f in (Path(__file__).parent / "preview").glob("*.parquet")}
preview = load_dataset("parquet", data_files=files)
print(preview, preview["train"][0]["quality"])
'''
RERUN = '''\
"""The recording of the samples in the Rerun viewer: pip install rerun-sdk"""
from pathlib import Path
import rerun as rr
recording = Path(__file__).parent / "shards.rrd"
rr.init("softgrip_published", spawn=__name__ == "__main__")
rr.log_file_from_path(recording)
'''
EXAMPLES = {"load_pytorch.py": PYTORCH, "load_datasets.py": DATASETS, "load_rerun.py": RERUN}


def check_room(place: Path, needed_bytes: int) -> None:
    """Refuse a disk that is too small, before anything is written.

    Parameters
    ----------
    place
        Folder that is written to; its nearest folder that exists is looked at.
    needed_bytes
        What will be written [bytes].

    Raises
    ------
    MachineError
        There is less free.
    """
    while not place.is_dir():
        place = place.parent
    free = shutil.disk_usage(place).free
    if free < needed_bytes:
        raise MachineError(
            f"{place} has {free / 1e6:.0f} MB free, and publishing takes {needed_bytes / 1e6:.0f}",
            "Free some ('make prune' shows what can go), or name another folder with --into",
        )


def not_there(files: Sequence[tuple[Path, Path]]) -> list[tuple[Path, Path]]:
    """Those of (from, to) whose target is missing or holds something else."""
    return [(source, target) for source, target in files if not _same_content(source, target)]


def _same_content(source: Path, target: Path) -> bool:
    if not target.is_file() or target.stat().st_size != source.stat().st_size:
        return False
    return file_sha256(target) == file_sha256(source)


def copy_files(files: Sequence[tuple[Path, Path]]) -> None:
    """Copy (from, to); each appears whole or not at all."""
    for source, target in files:
        with published(target) as scratch:
            shutil.copyfile(source, scratch)


def remove_former(folder: Path, kept: Collection[Path]) -> None:
    """Remove shards and previews that were published before and are no longer of the run."""
    for place, ending in ((SHARDS, "*.mcap"), (PREVIEW, "*.parquet")):
        for path in sorted((folder / place).rglob(ending)):
            if path not in kept:
                path.unlink()


def write_preview(index: Path, split: str, path: Path, rows: int) -> int:
    """Write some samples of a split as Parquet, equally far apart.

    Parameters
    ----------
    index
        The shards' index.
    split
        train, val or test.
    path
        The Parquet file.
    rows
        At most this many.

    Returns
    -------
    How many were written.

    Raises
    ------
    ArtifactError
        The split holds no sample.
    """
    parts: list[Samples] = []
    names: tuple[str, ...] = ()
    for shard in listed_shards(index, [split]):
        found, names = read_shard(shard)
        some = np.array(choose_evenly(len(found), rows), dtype=np.int64)
        parts.append(found.take(some))
    if not parts:
        raise ArtifactError(f"{index} holds no {split} samples", "Make the dataset again")
    samples = join_samples(parts)
    chosen = samples.take(np.array(choose_evenly(len(samples), rows), dtype=np.int64))
    write_parquet(path, chosen, names, f"{split}-", 0)
    return len(chosen)


def write_examples(folder: Path) -> None:
    """Write the loading examples."""
    for name, text in EXAMPLES.items():
        publish_bytes(folder / name, text.encode())
