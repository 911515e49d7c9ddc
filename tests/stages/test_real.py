"""`make real` on a folder of frames: sheet, page and figures, and frames that cannot be used."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.config.learning import NetworkConfig
from pipeline.errors import PictureError
from pipeline.network.export import export_onnx_bytes
from pipeline.network.ga_cnn import build_network
from stages.real import real
from tests.camera.scenes import HEIGHT_PX, WIDTH_PX, box, seen, table, written
from tests.network.test_inference import lively

ABOVE = (0.05, -0.35, 0.6)


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("frames")
    deeper = folder / "another_camera"
    deeper.mkdir()
    target = box((0.12, 0.10, 0.08), (0.0, 0.0, 0.04))
    mask = np.zeros((HEIGHT_PX, WIDTH_PX), dtype=np.uint8)
    mask[60:160, 90:230] = 255
    written(seen([table(), target], ABOVE, 0.001, posed=True), deeper, "masked", mask)
    written(seen([table()], ABOVE, 0.001, posed=True), folder, "empty")
    written(seen([table()], ABOVE, 0.001, posed=True), folder, "torn").write_bytes(b"no picture")
    (folder / "notes.txt").write_text("not a frame")
    network = folder / "small.onnx"
    config = NetworkConfig(layers=18, channels=(8, 8, 16, 16))
    network.write_bytes(export_onnx_bytes(lively(build_network(config, seed=0)), cells=24))
    out = tmp_path_factory.mktemp("real")
    real(folder, network=str(network), run="ci", out=out)
    return out


def test_every_use_of_every_frame_has_its_figures(results: Path) -> None:
    figures = json.loads((results / "real.json").read_text())
    rows = {(row["frame"], row["ranking"], row["kept_to_mask"]) for row in figures["trials"]}
    assert rows == {
        (frame, ranking, kept)
        for frame, uses in (("masked", (False, True)), ("empty", (False,)))
        for kept in uses
        for ranking in ("small.onnx", "analytic")
    }
    assert list(figures["unreadable"]) == ["torn.depth.png"]
    assert "cannot be read as a picture" in figures["unreadable"]["torn.depth.png"]
    for row in figures["trials"]:
        if row["frame"] == "empty":
            assert "nothing stands out of the support" in row["refused"]
            assert row["quality"] is None
            assert row["seconds"] is None
        else:
            assert row["in_mask"]  # nothing but the box stands on the table
            assert len(row["redrawn_moved_mm"]) == len(row["thinned_moved_mm"]) == 3
            assert row["seconds"] > 0
    analytic = [row for row in figures["trials"] if row["ranking"] == "analytic"]
    assert all(row["off_edges"] for row in analytic if row["frame"] == "masked")


def test_together_counts_what_each_says(results: Path) -> None:
    figures = json.loads((results / "real.json").read_text())
    for row in figures["together"]:
        same = [
            trial
            for trial in figures["trials"]
            if (trial["ranking"], trial["kept_to_mask"]) == (row["ranking"], row["kept_to_mask"])
        ]
        assert row["frames"] == len(same)
        assert row["seconds"] > 0
        assert row["with_a_choice"] == sum(trial["quality"] is not None for trial in same)
        assert row["off_edges"] == sum(bool(trial["off_edges"]) for trial in same)


def test_the_page_shows_sheet_and_reasons(results: Path) -> None:
    page = (results / "real.html").read_text()
    assert "data:image/png;base64," in page
    assert "cannot be read as a picture" in page
    assert "nothing stands out of the support" in page
    assert Image.open(results / "real.png").width > 1000


def test_a_folder_without_frames_says_how_they_are_named(tmp_path: Path) -> None:
    with pytest.raises(PictureError, match=r"holds no frame.*NAME\.depth\.png"):
        real(tmp_path, run="ci", out=tmp_path)
    with pytest.raises(PictureError, match="is no folder"):
        real(tmp_path / "missing", run="ci", out=tmp_path)
