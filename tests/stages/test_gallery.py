"""The gallery of a run: every object of the clutter is in its picture."""

import numpy as np
import pytest
from PIL import Image

from pipeline.config import load_run_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.sensing.ray_rendering import RayRenderer
from pipeline.sensing.rendering import render_views
from stages.gallery import make_gallery, portrait_camera


def test_all_objects_are_in_the_portrait(run: RunFolder) -> None:
    objects = {n: item for n, (item, _) in read_objects(run.artifact("objects")).items()}
    renderer = RayRenderer(load_run_config(run.config).scenes)
    for scene in read_scenes(run.artifact("scenes")):
        camera = portrait_camera(scene, objects)
        view = render_views(scene, objects, (camera,), renderer).views[0]
        assert set(np.unique(view.segmentation)) >= {p.body_id for p in scene.objects}
        edge = [view.segmentation[i] for i in (0, -1)] + [view.segmentation[:, i] for i in (0, -1)]
        assert not np.concatenate(edge).any()


def test_the_sheet_lies_beside_the_scenes(run: RunFolder) -> None:
    make_gallery(run)
    sheet = np.asarray(Image.open(run.path / "gallery.png").convert("RGB"))
    height, width = sheet.shape[:2]
    first = sheet[40 : height // 3, 20 : width // 3 - 20]
    assert np.unique(first.reshape(-1, 3), axis=0).shape[0] > 100


def test_without_scenes_it_says_what_to_make(run: RunFolder) -> None:
    with pytest.raises(ArtifactError, match="make scenes"):
        make_gallery(RunFolder(run.path.parent / "absent"))
