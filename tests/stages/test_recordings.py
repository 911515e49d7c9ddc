"""Each stage's recording as a person sees it: opened in the real viewer, off screen."""

import io

import numpy as np
import pytest
from PIL import Image

from pipeline.errors import MachineError
from pipeline.execution import RunFolder
from pipeline.recording.viewer import Sight, sight_of
from stages.graph import STAGES

TIMELINES = {
    "objects": "object",
    "scenes": "scene",
    "grasps": "grasp",
    "shards": "sample",
    "train": "epoch",
    "evaluate": "frame",
}
# Least share of a picture that is not background.
DRAWN = 0.02


def drawn_share(png: bytes) -> float:
    """Share of pixels that are brighter than the viewer's dark background and its grid."""
    pixels = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
    return float((pixels.max(axis=2) > 90).mean())


@pytest.fixture(scope="module", params=sorted(STAGES))
def seen(request: pytest.FixtureRequest, run: RunFolder) -> tuple[str, Sight]:
    try:
        return request.param, sight_of(run.recording(request.param))
    except MachineError as error:
        pytest.skip(f"the viewer needs a graphics driver: {error}")


def test_the_viewer_shows_all_of_it(seen: tuple[str, Sight]) -> None:
    stage, sight = seen
    assert sight.problems == ()
    assert sight.timeline == TIMELINES[stage]
    spatial = {
        "objects": "Catalogue, coloured by class, NSVR growing",
        "scenes": "Scene, cameras and coloured cloud",
        "grasps": "Pad (green: in contact), cloud and wrench, in GCS",
        "shards": "Clouds by growing q, units of r_G",
        "train": "Worst test samples: q / q-hat",
        "evaluate": "Scene, pad and its path",
    }
    assert drawn_share(sight.view_png[spatial[stage]]) > DRAWN
    assert drawn_share(sight.window_png) > DRAWN
