"""Training samples written and read, by MCAP and by what others would use, uncompressed all.

Every format holds the same batches of the same tensors, and reading touches every byte.
"""

import io
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import h5py
import numpy as np
import webdataset
import zarr

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.benchmarks.clock import seconds_of
from pipeline.labelling.grasps import LabelledGrasps
from pipeline.messages.clouds import cloud_batch, clouds_of
from pipeline.messages.samples import STORED_AS, read_samples, write_samples
from pipeline.network.samples import Samples

BATCH = 256  # samples a message, as grasps.samples_per_message
REPEATS = 5  # enough for a median, in seconds
# Of a file that is deleted after it is timed.
PROVENANCE = Provenance("bench", "0" * 64, "0" * 64, "0" * 64, 0, (), "bench")

Write = Callable[[Path, list[Samples]], None]
Read = Callable[[Path], Iterator[dict[str, np.ndarray]]]


def figures(samples: Samples) -> dict[str, object]:
    """MCAP against HDF5, Zarr, WebDataset and NumPy on the same samples: rates and ratios."""
    with tempfile.TemporaryDirectory() as scratch:
        rates = against_peers(samples, Path(scratch))
    peers = [name for name in rates if name != "mcap"]
    return {
        "storage": {
            name: {key: round(value, 1) for key, value in found.items()}
            for name, found in rates.items()
        },
        **{
            f"mcap_{way}_vs": {
                peer: round(rates["mcap"][f"{way}_mb_s"] / rates[peer][f"{way}_mb_s"], 2)
                for peer in peers
            }
            for way in ("read", "write")
        },
    }


def against_peers(samples: Samples, folder: Path) -> dict[str, dict[str, float]]:
    """Format → MB/s and samples/s of writing and of reading, all in this one call."""
    parts = [samples.take(slice(at, at + BATCH)) for at in range(0, len(samples), BATCH)]
    megabytes = sum(array.nbytes for part in parts for array in arrays_of(part).values()) / 1e6
    expected = checksum(arrays_of(part) for part in parts)
    figures = {}
    for name, (write, read) in FORMATS.items():
        path = folder / name
        writing = seconds_of(lambda w=write, p=path: w(p, parts), REPEATS)  # type: ignore[misc]
        if checksum(read(path)) != expected:
            raise AssertionError(f"{name} did not give back what was written")
        reading = seconds_of(lambda r=read, p=path: checksum(r(p)), REPEATS)  # type: ignore[misc]
        figures[name] = {
            "write_mb_s": megabytes / writing,
            "read_mb_s": megabytes / reading,
            "write_samples_s": len(samples) / writing,
            "read_samples_s": len(samples) / reading,
        }
    return figures


def samples_of_grasps(grasps: Sequence[LabelledGrasps]) -> Samples:
    """Labelled grasps as training samples; columns that do not affect storage are constants."""
    clouds = [clouds_of(cloud_batch(part.cloud, part.cloud_mask, rounded=True)) for part in grasps]
    count = sum(len(part) for part in grasps)
    return Samples(
        cloud=np.concatenate([cloud for cloud, _ in clouds]),
        cloud_mask=np.concatenate([mask for _, mask in clouds]),
        quality=np.concatenate([part.quality for part in grasps]),
        object_index=np.zeros(count, dtype=np.int64),
        shape_class=np.zeros(count, dtype=np.int64),
        level=np.ones(count, dtype=np.int64),
        pressure=np.concatenate([part.pressure for part in grasps]),
        proposal_weight=np.ones(count),
        pictures=np.ones(count, dtype=np.int64),
    )


def arrays_of(samples: Samples) -> dict[str, np.ndarray]:
    """The tensors of a batch as they are stored."""
    return {name: getattr(samples, name).astype(dtype) for name, dtype in STORED_AS.items()}


def checksum(batches: Iterator[dict[str, np.ndarray]]) -> int:
    """A sum over every byte, so that lazily mapped formats really read."""
    total = 0
    for batch in batches:
        for array in batch.values():
            total += int(np.ascontiguousarray(array).view(np.uint8).sum(dtype=np.uint64))
    return total


def write_mcap(path: Path, parts: list[Samples]) -> None:
    """Write MCAP as the shards stage does."""
    with ArtifactWriter(path, PROVENANCE, "none") as artifact:
        for index, part in enumerate(parts):
            write_samples(artifact, part, (), size=len(part), first=index)


def read_mcap(path: Path) -> Iterator[dict[str, np.ndarray]]:
    """Read MCAP as training does."""
    with open_artifact(path) as artifact:
        for samples in read_samples(artifact):
            yield _stored(samples)


def write_hdf5(path: Path, parts: list[Samples]) -> None:
    """Write HDF5 with one dataset for each tensor, chunked by batch."""
    with h5py.File(path, "w") as file:
        first = arrays_of(parts[0])
        count = sum(len(part) for part in parts)
        made = {
            name: file.create_dataset(
                name, (count, *a.shape[1:]), a.dtype, chunks=(min(BATCH, count), *a.shape[1:])
            )
            for name, a in first.items()
        }
        for index, part in enumerate(parts):
            for name, array in arrays_of(part).items():
                made[name][index * BATCH : index * BATCH + len(part)] = array


def read_hdf5(path: Path) -> Iterator[dict[str, np.ndarray]]:
    """Read HDF5 batch by batch."""
    with h5py.File(path) as file:
        for at in range(0, len(file["quality"]), BATCH):
            yield {name: file[name][at : at + BATCH] for name in STORED_AS}


def write_zarr(path: Path, parts: list[Samples]) -> None:
    """Write Zarr with one array for each tensor, chunked by batch."""
    root = zarr.open_group(path, mode="w")
    count = sum(len(part) for part in parts)
    for name, array in arrays_of(parts[0]).items():
        root.create_array(
            name,
            shape=(count, *array.shape[1:]),
            chunks=(min(BATCH, count), *array.shape[1:]),
            dtype=array.dtype,
            compressors=None,
        )
    for index, part in enumerate(parts):
        for name, array in arrays_of(part).items():
            root[name][index * BATCH : index * BATCH + len(part)] = array


def read_zarr(path: Path) -> Iterator[dict[str, np.ndarray]]:
    """Read Zarr batch by batch."""
    root = zarr.open_group(path, mode="r")
    for at in range(0, root["quality"].shape[0], BATCH):
        yield {name: np.asarray(root[name][at : at + BATCH]) for name in STORED_AS}


def write_webdataset(path: Path, parts: list[Samples]) -> None:
    """Write a tar with a group of .npy files for each batch."""
    with webdataset.TarWriter(str(path)) as tar:
        for index, part in enumerate(parts):
            files = {f"{name}.npy": _npy(array) for name, array in arrays_of(part).items()}
            tar.write({"__key__": f"{index:06d}", **files})


def read_webdataset(path: Path) -> Iterator[dict[str, np.ndarray]]:
    """Read the tar group by group with WebDataset's own pipeline."""
    for group in webdataset.WebDataset(str(path), shardshuffle=False).decode():
        yield {name: group[f"{name}.npy"] for name in STORED_AS}


def write_numpy(path: Path, parts: list[Samples]) -> None:
    """Write one .npy file for each tensor, the fastest format that has no index."""
    path.mkdir(exist_ok=True)
    for name in STORED_AS:
        np.save(path / f"{name}.npy", np.concatenate([arrays_of(part)[name] for part in parts]))


def read_numpy(path: Path) -> Iterator[dict[str, np.ndarray]]:
    """Read memory maps batch by batch."""
    maps = {name: np.load(path / f"{name}.npy", mmap_mode="r") for name in STORED_AS}
    for at in range(0, len(maps["quality"]), BATCH):
        yield {name: array[at : at + BATCH] for name, array in maps.items()}


def _stored(samples: Samples) -> dict[str, np.ndarray]:
    """Tensors as read: no conversion, as the views have the stored type."""
    return {name: getattr(samples, name) for name in STORED_AS}


def _npy(array: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


FORMATS: dict[str, tuple[Write, Read]] = {
    "mcap": (write_mcap, read_mcap),
    "hdf5": (write_hdf5, read_hdf5),
    "zarr": (write_zarr, read_zarr),
    "webdataset": (write_webdataset, read_webdataset),
    "numpy": (write_numpy, read_numpy),
}
