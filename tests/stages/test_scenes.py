"""Which clutters stage scenes builds, by what objects there are."""

from dataclasses import replace

import pytest

import stages.clutters
from pipeline.clutter.settled import SettledClutters
from pipeline.errors import SceneError
from pipeline.execution import RunFolder
from pipeline.execution.staleness import stage_context
from pipeline.messages.objects import read_objects
from stages.clutters import scene_jobs, settled_clutter
from stages.graph import SCENES, inputs_of

NONE = SettledClutters("")


def test_clutters_without_objects_are_left_out_or_refused(
    run: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    basic = {
        name: (item, "train")
        for name, (item, _) in read_objects(run.artifact("objects")).items()
        if item.shape_class == "basic"
    }
    assert basic
    monkeypatch.setattr(stages.clutters, "catalogue", lambda _: basic)
    context = stage_context(SCENES, run, inputs_of, None, workers=1)
    scenes = context.config.scenes.model_copy(update={"levels": (1, 4)})
    context = replace(context, config=context.config.model_copy(update={"scenes": scenes}))
    wanting = next(job for job in scene_jobs(context, NONE) if job.level == 4)
    with pytest.raises(SceneError, match="Level 4 needs typical objects of the train split"):
        settled_clutter(wanting)
    scenes = scenes.model_copy(update={"impossible": "left out"})
    config = context.config.model_copy(update={"scenes": scenes})
    left_out = settled_clutter(replace(wanting, config=config))
    assert isinstance(left_out, SceneError)
    assert "Level 4 needs typical objects" in left_out.what


def test_clutters_are_of_the_splits_that_are_wanted(run: RunFolder) -> None:
    context = stage_context(SCENES, run, inputs_of, None, workers=1)
    scenes = context.config.scenes.model_copy(update={"splits": ("test",)})
    config = context.config.model_copy(update={"scenes": scenes})
    assert {job.split for job in scene_jobs(replace(context, config=config), NONE)} == {"test"}


def test_test_clutters_stay_whatever_the_seed_of_the_run(run: RunFolder) -> None:
    context = stage_context(SCENES, run, inputs_of, None, workers=1)
    other = replace(context, config=context.config.model_copy(update={"seed": 77}))
    pairs = list(zip(scene_jobs(context, NONE), scene_jobs(other, NONE), strict=True))
    assert {one.split for one, _ in pairs} == {"train", "val", "test"}
    for one, two in pairs:
        assert (one.seed == two.seed) == (one.split == "test")
