"""Croissant metadata of a published dataset, by MLCommons' own library."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.artifacts.publishing import file_sha256

# Column of the Parquet preview → (name of mlcroissant's DataType, what it holds).
COLUMNS = {
    "key": ("TEXT", "Split and number of the sample"),
    "cloud": ("FLOAT", "Cells of the cloud under the pad, x y z in units of r_G, row by row"),
    "mask": ("BOOL", "Whether a camera saw the cell"),
    "quality": ("FLOAT", "Grasp quality q in [0, 1]"),
    "pressure": ("FLOAT", "p of Eq. (2), dimensionless"),
    "level": ("INTEGER", "Clutter level, 1 to 9"),
    "shape_class": ("TEXT", "basic, typical or complex, by NSVR"),
    "object": ("TEXT", "Name of the object"),
    "pictures": ("INTEGER", "From how many pictures the cloud was cut"),
    "proposal_weight": ("FLOAT", "First proposals that the sample stands for"),
}
PARQUET = "application/x-parquet"  # as mlcroissant names it


def croissant_metadata(
    folder: Path,
    splits: Mapping[str, Path],
    name: str,
    description: str,
    licence: str,
    version: str,
) -> dict[str, Any]:
    """The metadata of a folder with a Parquet file a split.

    Parameters
    ----------
    folder
        The published folder.
    splits
        Split → its Parquet file.
    name
        Name of the dataset.
    description
        What it is, in a sentence or two.
    licence
        Its licence in words.
    version
        Version of the dataset, MAJOR.MINOR.PATCH.

    Returns
    -------
    JSON-LD as a dictionary.

    Raises
    ------
    ModuleNotFoundError
        mlcroissant is not installed: it comes with the extra "export".
    """
    import mlcroissant as mlc  # an extra

    files = [
        mlc.FileObject(
            id=split,
            name=path.name,
            content_url=path.relative_to(folder).as_posix(),
            encoding_formats=[PARQUET],
            sha256=file_sha256(path),
        )
        for split, path in splits.items()
    ]
    records = [
        mlc.RecordSet(
            id=f"samples_{split}",
            name=f"samples_{split}",
            description=f"Samples of the {split} split",
            fields=[
                mlc.Field(
                    id=f"samples_{split}/{column}",
                    name=column,
                    description=words,
                    data_types=[getattr(mlc.DataType, kind)],
                    source=mlc.Source(file_object=split, extract=mlc.Extract(column=column)),
                    **({"is_array": True, "array_shape": "-1"} if _is_list(column) else {}),
                )
                for column, (kind, words) in COLUMNS.items()
            ],
        )
        for split in splits
    ]
    metadata = mlc.Metadata(
        name=name,
        description=description,
        license=[licence],
        version=version,
        distribution=files,
        record_sets=records,
    )
    found: dict[str, Any] = metadata.to_json()
    return found


def _is_list(column: str) -> bool:
    """Whether a column holds a list a sample."""
    return column in ("cloud", "mask")
