"""The embedded objects are closed solids of every class."""

from collections import Counter

import pytest

from pipeline.geometry.parametric import PARAMETRIC_OBJECTS, build
from pipeline.geometry.shape import nsvr, shape_class, volume
from pipeline.geometry.topology import components, is_closed


@pytest.mark.parametrize("name", sorted(PARAMETRIC_OBJECTS))
def test_each_is_one_closed_body_of_table_size(name: str) -> None:
    mesh = build(name)
    assert is_closed(mesh)
    assert len(components(mesh.faces)) == 1
    assert volume(mesh) > 0
    assert 0.01 < mesh.extents_m.max() < 0.5
    assert build(name).vertices_m.tobytes() == mesh.vertices_m.tobytes()


def test_there_are_enough_of_every_class() -> None:
    classes = Counter(shape_class(nsvr(build(name))) for name in PARAMETRIC_OBJECTS)
    assert sum(classes.values()) >= 35
    assert len(classes) == 3
    assert min(classes.values()) >= 10
