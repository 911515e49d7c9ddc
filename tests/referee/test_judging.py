"""Many grasps: an even choice, every figure varied, and a scene judged."""

import numpy as np
import trimesh

from pipeline.config.referee import RefereeConfig
from pipeline.geometry.mesh import Mesh
from pipeline.referee.judging import (
    chosen_evenly,
    judged,
    placed,
    stands_for,
    variations,
    weights_borne_n,
)

RADIUS_M = 0.025


def test_a_choice_is_even_over_tenths_and_objects() -> None:
    rng = np.random.default_rng(0)
    quality = np.concatenate([rng.random(1000) * 0.1, rng.random(100)])
    objects = np.concatenate([np.zeros(1000), np.ones(100)]).astype(np.int64)
    chosen = chosen_evenly(quality, objects, 110, rng)
    assert len(chosen) == len(set(chosen)) == 110
    assert (objects[chosen] == 1).sum() > 80
    tenth = np.minimum((10 * quality[chosen]).astype(int), 9)
    assert np.bincount(tenth, minlength=10).max() < 30
    assert len(chosen_evenly(quality, objects, 5000, rng)) == 1100


def test_chosen_grasps_stand_for_all_of_their_tenth() -> None:
    quality = np.array([0.01, 0.02, 0.03, 0.04, 0.55, 0.58, 1.0])
    np.testing.assert_array_equal(stands_for(quality, np.array([0, 3, 5, 6])), [2, 2, 2, 1])


def test_each_figure_is_halved_and_doubled_where_it_may_be() -> None:
    config = RefereeConfig()
    found = list(variations(config))
    assert len(found) == len({(name, factor) for name, factor, _ in found})
    for name, factor, changed in found:
        assert getattr(changed, name) == factor * getattr(config, name)
        others = changed.model_copy(update={name: getattr(config, name)})
        assert others == config
    names = {name for name, _, _ in found}
    assert names == set(RefereeConfig.model_fields) - {"element_rg"}
    assert ("discharge", 2.0) not in {(name, factor) for name, factor, _ in found}


def test_a_box_on_the_table_is_borne_and_the_table_is_not() -> None:
    box = trimesh.creation.box(extents=(0.08, 0.08, 0.04))
    mesh = Mesh(np.asarray(box.vertices), np.asarray(box.faces))
    on_table = np.eye(4)
    on_table[2, 3] = 0.02
    scene = placed([mesh], [on_table], 1.0, 0.15)
    top, table = np.eye(4), np.eye(4)
    top[2, 3], table[0, 3] = 0.04, 0.3
    poses = np.array([top, table])
    found = judged(RefereeConfig(), RADIUS_M, scene, poses, np.array([0, 0]))
    assert found.borne_n[0] > 5.0
    assert found.straight_n[0] > found.borne_n[0]
    assert found.borne_n[1] == found.suction_n[1] == 0.0
    np.testing.assert_array_equal(
        weights_borne_n(RefereeConfig(), RADIUS_M, scene, poses, np.array([0, 0])), found.borne_n
    )
