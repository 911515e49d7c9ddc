"""The whole referee: flat seals, holes, cracks, refinement, symmetry, and both ways the same."""

import numpy as np
import pytest
import trimesh

from pipeline.geometry.mesh import Mesh
from pipeline.referee.seal import Seal, seal, straight_pull_n, weight_borne_n
from pipeline.referee.surface import surface_under
from pipeline.world.posed_bodies import PosedBodies
from pipeline.world.raycasting import RayScene
from tests.referee.shapes import CONFIG, level_surface, referee, rough, sphere

PAD = referee()
DISC = PAD.disc
X, Y = DISC.vertices_xy_m.T
AWAY = np.hypot(X, Y)


def on_height(height: np.ndarray, on_target: np.ndarray | None = None) -> Seal:
    return seal(PAD, level_surface(DISC, height, on_target))


def test_a_plane_is_sealed_in_full() -> None:
    """Vacuum of a closed fan times area, less what leaks through roughness at the rim."""
    full_n = CONFIG.fan_vacuum_pa * DISC.area_m2
    found = on_height(np.zeros(len(X)))
    assert 0.95 * full_n < found.pull_n < full_n
    assert straight_pull_n(found) == pytest.approx(found.pull_n)
    smooth = referee(roughness_m=1e-6)
    assert seal(smooth, level_surface(DISC, np.zeros(len(X)))).pull_n == pytest.approx(
        full_n, rel=1e-3
    )


def test_a_pit_is_evacuated_and_a_hole_leaks() -> None:
    """The same opening in the middle: with a floor it seals, through to the air it does not."""
    inside = AWAY < 0.008
    pit = on_height(np.where(inside, -0.02, 0.0))
    hole = on_height(np.where(inside, -np.inf, 0.0), ~inside)
    plane = on_height(np.zeros(len(X)))
    assert pit.pull_n == pytest.approx(plane.pull_n, rel=0.01)
    assert hole.pull_n < 0.9 * plane.pull_n
    assert hole.vacuum.flow_m3_s > 3 * pit.vacuum.flow_m3_s


def test_a_crack_between_two_bodies_leaks() -> None:
    """Two boxes of one height: what is sealed on the neighbour holds nothing of the target."""
    whole = on_height(np.zeros(len(X)))
    half = on_height(np.zeros(len(X)), X < 0.0)
    assert half.pull_n < 0.5 * whole.pull_n
    assert half.vacuum.flow_m3_s > whole.vacuum.flow_m3_s
    assert not half.touches[X > 0].any()


def test_less_under_the_pad_bears_less() -> None:
    pulls = [
        straight_pull_n(on_height(np.where(r > AWAY, 0.0, -np.inf), r > AWAY))
        for r in (0.006, 0.010, 0.015, 0.020, 0.026)
    ]
    assert (np.diff(pulls) > 0).all()
    pulls = [straight_pull_n(seal(PAD, sphere(DISC, r))) for r in (0.026, 0.035, 0.05, 0.1, 1.0)]
    assert (np.diff(pulls) > 0).all()


def test_refinement_converges() -> None:
    """Balls, cylinders, a groove, an edge, waves: the error falls with the elements' size."""

    def pulls(element_rg: float) -> np.ndarray:
        pad = referee(element_rg)
        x, y = pad.disc.vertices_xy_m.T
        edge = x < 0.0131
        surfaces = [sphere(pad.disc, ball_m) for ball_m in (0.026, 0.03, 0.04, 0.06, 0.12)]
        surfaces += [
            level_surface(pad.disc, np.sqrt(r**2 - x**2) - r) for r in (0.026, 0.035, 0.05)
        ]
        surfaces += [
            level_surface(pad.disc, np.where(np.abs(y) < 0.003, -0.002, 0.0)),
            level_surface(pad.disc, np.where(edge, 0.0, -np.inf), edge),
            level_surface(pad.disc, 2e-3 * np.sin(x / 0.004)),
        ]
        return np.array([seal(pad, surface).pull_n for surface in surfaces])

    fine = pulls(1 / 32)
    coarse, middle, finer = (np.abs(pulls(size) / fine - 1) for size in (1 / 8, 1 / 16, 1 / 24))
    assert coarse.mean() > middle.mean() > finer.mean()
    assert middle.mean() < 0.05
    assert middle.max() < 0.15
    assert finer.max() < 0.06


def test_a_sixth_of_a_turn_and_a_mirror_change_nothing() -> None:
    pad = referee()
    surface = rough(DISC, np.random.default_rng(3), 1e-3)
    points = X + 1j * Y
    first = seal(pad, surface)
    for moved in (points * np.exp(1j * np.pi / 3), np.conj(points)):
        image = np.abs(moved[:, None] - points[None]).argmin(axis=0)
        turned = level_surface(DISC, surface.height_m[image], surface.on_target[image])
        same = level_surface(DISC, surface.height_m, surface.on_target)
        assert seal(pad, turned).pull_n == pytest.approx(seal(pad, same).pull_n, rel=1e-5)
    assert first.pull_n > 0.0


@pytest.mark.parametrize("seed", range(8))
def test_compiled_and_plain_agree(seed: int) -> None:
    rng = np.random.default_rng(seed)
    surface = rough(DISC, rng, rng.choice([3e-4, 1.5e-3, 5e-3]))
    quick, plain = seal(PAD, surface), seal(PAD, surface, way="plain")
    assert quick.pull_n == pytest.approx(plain.pull_n, rel=1e-3, abs=1e-3)
    assert straight_pull_n(quick) == pytest.approx(straight_pull_n(plain), rel=5e-3, abs=1e-3)


def can() -> Mesh:
    shape = trimesh.creation.cylinder(radius=0.033, height=0.10, sections=128)
    return Mesh(np.asarray(shape.vertices), np.asarray(shape.faces))


def posed(position: tuple[float, float, float], tilt_rad: float = 0.0) -> np.ndarray:
    pose = np.eye(4)
    c, s = np.cos(tilt_rad), np.sin(tilt_rad)
    pose[:3, :3] = [[c, 0, s], [0, 1, 0], [-s, 0, c]]
    pose[:3, 3] = position
    return pose


def test_a_can_is_held_by_its_lid_and_by_its_side_as_far_as_it_bends() -> None:
    scene = RayScene([can()])
    centre = np.zeros(3)
    borne = {}
    for name, pose in {
        "lid": posed((0, 0, 0.05)),
        "aside": posed((0.02, 0, 0.05)),
        "side": posed((0.033, 0, 0), np.pi / 2),
        "past the edge": posed((0.033, 0, 0.05)),
    }.items():
        surface, _ = surface_under(DISC, pose, scene, 0, 0.02)
        found = seal(PAD, surface)
        borne[name] = weight_borne_n(found, CONFIG, pose, centre)
    assert borne["lid"] > borne["aside"] > borne["past the edge"]
    assert borne["lid"] > borne["side"]
    # Lifted at 9.81 + 3, and a side force far below that turns the can about the pad.
    assert borne["lid"] < PAD.fan.vacuum_pa * DISC.area_m2 * 9.81 / 12.81


def test_world_and_pad_may_be_turned_together() -> None:
    """Up stays up, so gravity sees the same: a turn about the vertical, and a shift."""
    base = posed((0.01, 0.004, 0.05), 0.1)
    turn = np.eye(4)
    turn[:2, :2] = [[0.6, -0.8], [0.8, 0.6]]
    turn[:3, 3] = (0.3, -0.2, 0.1)
    centre = np.array([0.002, 0.001, -0.01])
    borne = []
    for move in (np.eye(4), turn):
        surface, _ = surface_under(DISC, move @ base, RayScene([can().transformed(move)]), 0, 0.02)
        found = seal(PAD, surface)
        config = CONFIG.model_copy(update={"side_acceleration_m_s2": 0.0})
        moved = move[:3, :3] @ centre + move[:3, 3]
        borne.append(weight_borne_n(found, config, move @ base, moved))
    assert borne[0] == pytest.approx(borne[1], rel=1e-3)


def test_bodies_that_move_are_seen_as_bodies_that_do_not() -> None:
    pose = posed((0.028, 0.0, 0.05))
    fixed, _ = surface_under(DISC, pose, RayScene([can()]), 0, 0.02)
    moving, below = surface_under(
        DISC, pose, PosedBodies({7: can()}, 1.0).at({7: np.eye(4)}), 7, 0.02
    )
    np.testing.assert_array_equal(fixed.on_target, moving.on_target)
    np.testing.assert_allclose(fixed.height_m[fixed.on_target], moving.height_m[moving.on_target])
    assert set(np.unique(below)) <= {0, 7}
