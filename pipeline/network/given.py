"""A network that a person names, as the export that control runs, held to a run's clouds."""

from dataclasses import dataclass
from pathlib import Path

from pipeline.errors import ArtifactError, ContentError
from pipeline.network.exported import check_onnx_bytes
from pipeline.network.released_files import EXPORT_FILE, RELEASED, RELEASED_FOLDER

CHECKPOINT_SUFFIX = ".safetensors"


@dataclass(frozen=True)
class GivenNetwork:
    """A network as it was given.

    Attributes
    ----------
    name
        What messages call it.
    exported
        The network as ONNX, by `export.export_onnx_bytes`.
    """

    name: str
    exported: bytes


def given_network(named: str, cells: int) -> GivenNetwork:
    """Read a network and check that a run's clouds fit it.

    Parameters
    ----------
    named
        ``released``, or the path of an export (.onnx) or of a checkpoint (.safetensors).
    cells
        Cells a side of the run's clouds, ``sensing.grid_cells``.

    Returns
    -------
    The network.

    Raises
    ------
    ArtifactError
        The file cannot be read, is no network of this project, or takes other channels or cells.
    """
    path = RELEASED_FOLDER / EXPORT_FILE if named == RELEASED else Path(named)
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ArtifactError(
            f"{named} cannot be read as a network: {error.strerror}",
            f"NETWORK is '{RELEASED}', or a file: runs/<run>/train/{EXPORT_FILE}, or a "
            f"{CHECKPOINT_SUFFIX} file beside it",
        ) from error
    try:
        if path.suffix == CHECKPOINT_SUFFIX:
            # PyTorch takes seconds to import, and an export is read without it.
            from pipeline.network.checkpoint import load_checkpoint_bytes
            from pipeline.network.export import export_onnx_bytes

            data = export_onnx_bytes(load_checkpoint_bytes(data), cells)
        taken = check_onnx_bytes(data)
    except ContentError as error:
        raise ArtifactError(f"{path}: {error.what}", error.remedy) from error
    if taken.cells != cells:
        raise ArtifactError(
            f"{path} takes clouds of {taken.cells} by {taken.cells} cells, and sensing.grid_cells "
            f"of the run is {cells}",
            f"Name a RUN whose sensing.grid_cells is {taken.cells}, or another network",
        )
    return GivenNetwork("the released network" if named == RELEASED else str(path), data)
