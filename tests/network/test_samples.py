"""Samples that would train nonsense are refused."""

import numpy as np
import pytest

from pipeline.errors import ArtifactError
from pipeline.network.samples import GraspTensors
from tests.checked_shapes import unchecked
from tests.network.planes import planes_with_holes

GOOD = planes_with_holes(8, seed=0)


def test_grid_that_lies_the_other_way_is_refused() -> None:
    for cloud in (GOOD.cloud.swapaxes(1, 2), GOOD.cloud[:, ::-1], GOOD.cloud[:, :, ::-1]):
        with pytest.raises(ArtifactError, match="must grow with"):
            GraspTensors(cloud=cloud, mask=GOOD.mask, quality=GOOD.quality)


@pytest.mark.parametrize("bad", [1.5, -0.1, np.nan])
def test_quality_outside_its_range_is_refused(bad: float) -> None:
    quality = GOOD.quality.copy()
    quality[3] = bad
    with pytest.raises(ArtifactError, match="outside"):
        GraspTensors(cloud=GOOD.cloud, mask=GOOD.mask, quality=quality)


def test_shapes_that_disagree_and_empty_splits_are_refused() -> None:
    with unchecked(), pytest.raises(ArtifactError, match="disagree in shape"):
        GraspTensors(cloud=GOOD.cloud, mask=GOOD.mask[:4], quality=GOOD.quality)
    with pytest.raises(ArtifactError, match="no samples"):
        GraspTensors(cloud=GOOD.cloud[:0], mask=GOOD.mask[:0], quality=GOOD.quality[:0])


def test_digest_follows_the_content() -> None:
    again, other = planes_with_holes(8, seed=0), planes_with_holes(8, seed=1)
    assert GOOD.sha256() == again.sha256() != other.sha256()
