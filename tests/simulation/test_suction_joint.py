"""The joint between pad and object: what it pulls with, and at which lever."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh

from pipeline.config import RunConfig
from pipeline.physics.engine import add_body, new_world
from pipeline.simulation.suction_joint import SuctionJoint
from tests.bodies import catalogue_object, pose_at


@dataclass
class HoldsAll:
    """A bearing that never breaks and remembers what it was asked to bear."""

    asked: list[np.ndarray] = field(default_factory=list)
    pressure: float = 1.0
    closes: bool = True

    def seals(self, at_rest: np.ndarray) -> bool:
        return at_rest.size > 0

    def largest_scale(self, loads: np.ndarray) -> float:
        return float(len(loads))

    def bears(self, load: np.ndarray) -> bool:
        self.asked.append(load)
        return True


def test_an_object_that_trails_the_pad_pulls_at_the_lever_where_it_was_sealed(
    tmp_path: Path,
) -> None:
    scenes = RunConfig().scenes
    item = catalogue_object("it", trimesh.creation.box(extents=(0.08, 0.06, 0.04)), tmp_path)
    world = new_world(scenes, render=False)
    body = add_body(world, item, pose_at(0, 0, 0.5), 1, (0.5, 0.5, 0.5), scenes)
    bearing = HoldsAll()
    joint = SuctionJoint.close(body, item, bearing, pose_at(0.01, 0, 0.52))
    load, holds = joint.carry(pose_at(0.06, 0, 0.52))  # the pad is 50 mm ahead
    assert holds
    # At its lever of (-10, 0, -20) mm the object's force has this moment, wherever it trails.
    np.testing.assert_allclose(load[3:], np.cross([-0.01, 0.0, -0.02], load[:3]), atol=1e-6)
    assert load[0] < 0.0  # it is drawn after the pad, and so holds it back
    np.testing.assert_allclose(load[2], -item.mass_kg * 9.81, rtol=1e-5)
    np.testing.assert_array_equal(bearing.asked, [load])
