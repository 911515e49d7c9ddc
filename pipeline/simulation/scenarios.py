"""Supplement VIII as scenes: transparent, flush neighbours, slim, moving; and a plain one beside.

Each is one or two boxes on the table, turned and placed at random from trial to trial, so that a
row of results says one thing.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float

from pipeline.config import RunConfig
from pipeline.geometry.catalogue import CatalogueObject, Material
from pipeline.geometry.mesh import Mesh
from pipeline.geometry.shape import solid_properties
from pipeline.world.scene import ClutterScene, PlacedObject

_FACE_M = 0.006  # faces no larger than the pad's cells


@dataclass(frozen=True)
class Scenario:
    """What lies on the table, and how fast it passes.

    Attributes
    ----------
    sides_m
        Of each box.
    gap_m
        Between two boxes that stand side by side along their y.
    speed_m_s
        Along world x, as on a conveyor.
    segmented
        Whether objects are told by colour.
    """

    name: str
    sides_m: tuple[float, float, float]
    count: int = 1
    gap_m: float = 0.0
    material: Material = "opaque"
    speed_m_s: float = 0.0
    segmented: bool = False


_PLAIN = (0.07, 0.07, 0.04)  # a box that the pad seals on with room to spare
_SLIM = (0.14, 0.024, 0.03)  # Supplement VIII: a bar narrower than the pad
# The failure modes of Supplement VIII, one after the other.
SCENARIOS = (
    Scenario("plain", _PLAIN),
    Scenario("transparent", _PLAIN, material="transparent"),
    Scenario("transparent, segmented", _PLAIN, material="transparent", segmented=True),
    Scenario("flush neighbours", (0.06, 0.06, 0.04), count=2, gap_m=0.0005),
    Scenario("slim, alone", _SLIM),
    Scenario("slim, side by side", _SLIM, count=2, gap_m=0.004),
    Scenario("moving, 10 mm/s", _PLAIN, speed_m_s=0.010),
    Scenario("moving, 25 mm/s", _PLAIN, speed_m_s=0.025),
    Scenario("moving, 50 mm/s", _PLAIN, speed_m_s=0.050),
    Scenario("moving, 100 mm/s", _PLAIN, speed_m_s=0.100),
)


def seeing(config: RunConfig, scenario: Scenario) -> RunConfig:
    """The run's configuration, with segmented pictures where the scenario has them, only there."""
    segmentation = "ideal" if scenario.segmented else "none"
    evaluate = config.evaluate.model_copy(update={"segmentation": segmentation})
    return config.model_copy(update={"evaluate": evaluate})


def trials(
    scenario: Scenario, count: int, density_kg_m3: float, rng: np.random.Generator
) -> Iterator[tuple[ClutterScene, dict[str, CatalogueObject]]]:
    """So many scenes of a kind."""
    item = _box(scenario, density_kg_m3)
    for number in range(count):
        middle = np.array([*rng.uniform(-0.1, 0.1, 2), 0.0])
        # What passes begins upstream.
        middle[0] -= 0.2 if scenario.speed_m_s else 0.0
        angle = rng.uniform(-math.pi, math.pi)
        step = scenario.sides_m[1] + scenario.gap_m
        placed = tuple(
            PlacedObject(
                item.name,
                index + 1,
                _standing(middle, angle, (index - (scenario.count - 1) / 2) * step, scenario),
            )
            for index in range(scenario.count)
        )
        gaps = np.full(scenario.count, scenario.gap_m if scenario.count > 1 else np.inf)
        scene = ClutterScene(
            f"{scenario.name} {number:02d}", 0, "test", number, placed, gaps, (), 0.0, ()
        )
        yield scene, {item.name: item}


def _standing(
    middle_m: Float[np.ndarray, " 3"], angle_rad: float, aside_m: float, scenario: Scenario
) -> Float[np.ndarray, "4 4"]:
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    pose = np.eye(4)
    pose[:2, :2] = [[cosine, -sine], [sine, cosine]]
    pose[:3, 3] = middle_m + aside_m * pose[:3, 1]
    pose[2, 3] = scenario.sides_m[2] / 2
    return pose


def _box(scenario: Scenario, density_kg_m3: float) -> CatalogueObject:
    shape = trimesh.creation.box(scenario.sides_m).subdivide_to_size(_FACE_M)
    mesh = Mesh(np.asarray(shape.vertices, np.float64), np.asarray(shape.faces, np.int64))
    coarse = trimesh.creation.box(scenario.sides_m)
    part = Mesh(np.asarray(coarse.vertices, np.float64), np.asarray(coarse.faces, np.int64))
    return CatalogueObject(
        name=scenario.name,
        source="scenario",
        source_sha256="scenario",
        unit="m",
        unit_known_by="declared",
        repairs=(),
        scale=1.0,
        stretch=np.ones(3),
        target_extent_m=max(scenario.sides_m),
        **solid_properties(mesh, density_kg_m3),
        mesh=mesh,
        convex_parts=(part,),
        material=scenario.material,
    )
