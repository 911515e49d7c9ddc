"""Which clutters stage scenes builds, by what objects there are."""

from dataclasses import replace

import pytest

import stages.scenes
from pipeline.errors import SceneError
from pipeline.execution import RunFolder
from pipeline.execution.staleness import stage_context
from pipeline.messages.objects import read_objects
from stages.graph import SCENES, inputs_of
from stages.scenes import scene_jobs, settled_clutter


def test_clutters_without_objects_are_left_out_or_refused(
    run: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    basic = {
        name: (item, "train")
        for name, (item, _) in read_objects(run.artifact("objects")).items()
        if item.shape_class == "basic"
    }
    assert basic
    monkeypatch.setattr(stages.scenes, "catalogue", lambda _: basic)
    context = stage_context(SCENES, run, inputs_of, None, workers=1)
    scenes = context.config.scenes.model_copy(update={"levels": (1, 4)})
    context = replace(context, config=context.config.model_copy(update={"scenes": scenes}))
    refused = scene_jobs(context)
    assert {(job.level, job.split) for job in refused} >= {(1, "train"), (4, "train"), (1, "test")}
    with pytest.raises(SceneError, match="Level 4 needs typical objects of the train split"):
        settled_clutter(next(job for job in refused if job.level == 4))
    scenes = scenes.model_copy(update={"without_objects": "leave out"})
    context = replace(context, config=context.config.model_copy(update={"scenes": scenes}))
    assert {(job.level, job.split) for job in scene_jobs(context)} == {(1, "train")}
