"""Each stage's recording as a person sees it: opened in the real viewer, off screen."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
import rerun as rr
import rerun.blueprint as rrb
from PIL import Image
from rerun.chunk import RrdReader

from pipeline.errors import MachineError
from pipeline.execution import RunFolder
from pipeline.recording.recording import LARGEST_MB, ROOTS, TIMELINES
from pipeline.recording.viewer import ViewerState, photograph
from stages.graph import STAGES

# Least share of a view that is drawn, beyond what an empty one has of words and grid.
DRAWN = 0.001


def drawn_share(png: bytes) -> float:
    """Share of pixels that are brighter than the viewer's dark background and its grid."""
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
    return float((pixels.max(axis=2) > 90).mean())


def seen_or_skipped(recording: Path) -> ViewerState:
    try:
        return photograph(recording)
    except MachineError as error:
        pytest.skip(f"the viewer needs a graphics driver: {error}")


@pytest.fixture(scope="module")
def empty_share(tmp_path_factory: pytest.TempPathFactory) -> float:
    """What an empty 3-D view has drawn in it."""
    path = tmp_path_factory.mktemp("empty") / "empty.rrd"
    stream = rr.RecordingStream("softgrip_empty", recording_id="empty")
    stream.save(path, default_blueprint=rrb.Blueprint(rrb.Spatial3DView(origin="/", name="empty")))
    stream.log("notes/nothing", rr.TextDocument("nothing"), static=True)
    stream.flush()
    stream.disconnect()
    return drawn_share(seen_or_skipped(path).view_png["empty"])


@pytest.fixture(scope="module", params=sorted(STAGES))
def seen(request: pytest.FixtureRequest, run: RunFolder) -> tuple[str, ViewerState]:
    return request.param, seen_or_skipped(run.recording(request.param))


def test_the_viewer_shows_all_of_it(seen: tuple[str, ViewerState], empty_share: float) -> None:
    stage, sight = seen
    assert sight.problems == ()
    assert sight.timeline == TIMELINES[stage]
    spatial = {
        "objects": "Catalogue, coloured by class, NSVR growing",
        "scenes": "Scene, cameras and coloured cloud",
        "grasps": "Pad by p w_j (dark 0, yellow 1.1; red: lifted), wrench, cloud; in GCS",
        "shards": "Clouds by growing q, units of r_G",
        "train": "Worst test samples: q / q-hat",
        "evaluate": "Scene, gripper and its path, candidates by q-hat",
    }
    assert drawn_share(sight.view_png[spatial[stage]]) > empty_share + DRAWN


@pytest.mark.parametrize("stage", STAGES)
def test_paths_and_timelines_are_named_alike(stage: str, run: RunFolder) -> None:
    roots, timelines = set(), set()
    for chunk in RrdReader(run.recording(stage)).stream():
        if chunk.entity_path.startswith("/__"):
            continue  # Rerun's own: properties of the recording
        roots.add(chunk.entity_path.split("/")[1])
        timelines |= set(chunk.timeline_names)
    assert roots <= set(ROOTS)
    assert timelines - {"log_time", "log_tick"} == {TIMELINES[stage]}


@pytest.mark.parametrize("stage", STAGES)
def test_the_summary_says_what_recording_cost(stage: str, run: RunFolder) -> None:
    summary = json.loads(run.summary(stage).read_text())
    assert 0 < summary["recording_share"] < 1
    assert 0 < summary["recording_mb"] < LARGEST_MB
    assert summary["recording_mb"] == pytest.approx(run.recording(stage).stat().st_size / 1e6, 1e-2)
