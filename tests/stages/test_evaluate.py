"""Which clutters are picked."""

from dataclasses import replace

import pytest

from pipeline.execution import RunFolder
from pipeline.execution.staleness import stage_context
from stages.evaluate import clutters
from stages.graph import EVALUATE, inputs_of


@pytest.mark.parametrize("split", ["val", "test"])
def test_clutters_are_of_the_split_that_is_asked_for(run: RunFolder, split: str) -> None:
    context = stage_context(EVALUATE, run, inputs_of, None, workers=1)
    wanted = context.config.evaluate.model_copy(update={"split": split})
    config = context.config.model_copy(update={"evaluate": wanted})
    found = clutters(replace(context, config=config))
    assert [scene.split for scene in found] == [split]
