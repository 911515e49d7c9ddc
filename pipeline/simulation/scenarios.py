"""The failure modes of Supplement VIII as scenes: transparent, touching, slim and moving objects.

Each scenario is one or two boxes on the table, at a random place and angle in each trial. All else
stays the same, so that a row of the results shows the effect of one property. A plain box is the
comparison.
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
    """What lies on the table, and how fast it moves.

    Attributes
    ----------
    name
        Name in the table of results.
    sides_m
        Sides of each box [m].
    count
        Number of boxes.
    gap_m
        Distance between two boxes side by side along their y axis [m].
    material
        Opaque or transparent.
    speed_m_s
        Speed along world x, as on a conveyor [m/s].
    segmented
        Whether pictures tell which object each pixel shows.
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


def with_segmentation(config: RunConfig, scenario: Scenario) -> RunConfig:
    """The run's configuration, with segmented pictures exactly where the scenario asks for them."""
    segmentation = "ideal" if scenario.segmented else "none"
    evaluate = config.evaluate.model_copy(update={"segmentation": segmentation})
    return config.model_copy(update={"evaluate": evaluate})


def make_trials(
    scenario: Scenario, count: int, density_kg_m3: float, rng: np.random.Generator
) -> Iterator[tuple[ClutterScene, dict[str, CatalogueObject]]]:
    """Make scenes of one scenario, each with its boxes at a random place and angle.

    Parameters
    ----------
    scenario
        What lies on the table.
    count
        Number of scenes.
    density_kg_m3
        Density of the boxes [kg/m^3].
    rng
        Draws places and angles.

    Yields
    ------
    tuple[ClutterScene, dict[str, CatalogueObject]]
        A scene, and its objects by name.
    """
    item = _box(scenario, density_kg_m3)
    for number in range(count):
        middle = np.array([*rng.uniform(-0.1, 0.1, 2), 0.0])
        # A moving box starts upstream of the middle.
        middle[0] -= 0.2 if scenario.speed_m_s else 0.0
        angle = rng.uniform(-math.pi, math.pi)
        step = scenario.sides_m[1] + scenario.gap_m
        placed = tuple(
            PlacedObject(
                item.name,
                index + 1,
                _box_pose(middle, angle, (index - (scenario.count - 1) / 2) * step, scenario),
            )
            for index in range(scenario.count)
        )
        gaps = np.full(scenario.count, scenario.gap_m if scenario.count > 1 else np.inf)
        scene = ClutterScene(
            f"{scenario.name} {number:02d}", 0, "test", number, placed, gaps, (), 0.0, ()
        )
        yield scene, {item.name: item}


def _box_pose(
    middle_m: Float[np.ndarray, " 3"], angle_rad: float, aside_m: float, scenario: Scenario
) -> Float[np.ndarray, "4 4"]:
    """world_from_object of a box on the table, moved sideways along its own y axis."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    pose = np.eye(4)
    pose[:2, :2] = [[cosine, -sine], [sine, cosine]]
    pose[:3, 3] = middle_m + aside_m * pose[:3, 1]
    pose[2, 3] = scenario.sides_m[2] / 2
    return pose


def _box(scenario: Scenario, density_kg_m3: float) -> CatalogueObject:
    """The scenario's box as an object of the catalogue."""
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
