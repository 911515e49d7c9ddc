"""A clutter of a level: built, settled, measured, and refused unless it meets its definition."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from pipeline.clutter.dropping import drop_again, drop_pile, resting_pose
from pipeline.clutter.gaps import Surface, nearest_gaps_m, pairwise_gaps_m, penetration_m
from pipeline.clutter.levels import Distribution, level_of
from pipeline.clutter.placement import place_isolated, place_multiple
from pipeline.clutter.settled import SettledClutter, generator_at, standing
from pipeline.config.scenes import ScenesConfig
from pipeline.errors import SceneError
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.physics.engine import add_body, new_world
from pipeline.physics.settling import fallen_off, settle
from pipeline.world.scene import ClutterScene, PlacedObject

_DROPS_AGAIN = 25  # drops of one pile before its objects are drawn anew
_COLOUR = (0.5, 0.5, 0.5)  # physics has no eyes


def build_clutter(
    scene_id: str,
    level: int,
    split: str,
    pool: Sequence[CatalogueObject],
    config: ScenesConfig,
    seed: int,
    settled: SettledClutter | None = None,
) -> ClutterScene:
    """A clutter of ``objects_per_clutter`` objects from ``pool``, without views yet.

    Each object is drawn as often as any other, give or take one. A clutter that misses its
    level's definition is drawn again, at most ``placement_attempts`` times. One that was built
    before is built again of its members, whatever other objects there are today.

    Parameters
    ----------
    scene_id
        What the scene is called.
    level
        1 to 9, Table II.
    split
        Split that the objects of the pool belong to.
    pool
        Objects to draw from.
    config
        Section scenes of the run.
    seed
        Of everything that is drawn.
    settled
        What it is built of again; all members are in the pool.

    Returns
    -------
    The clutter at rest, its gaps measured.

    Raises
    ------
    SceneError
        No attempt met the definition; the last reason is in the message.
    """
    _, distribution = level_of(level)
    reason = "none was tried"
    for items, rng in _draws(pool, config, seed, settled):
        stood = standing(rng)
        try:
            if distribution is Distribution.STACKED:
                poses, settle_time_s = _settle_pile(items, config, rng)
            else:
                poses, settle_time_s = _settle_placed(items, distribution, config, rng)
            gaps = measure_gaps(items, poses, distribution, config)
        except SceneError as error:
            reason = error.what
            continue
        return ClutterScene(
            scene_id=scene_id,
            level=level,
            split=split,
            seed=seed,
            objects=tuple(
                PlacedObject(item.name, body_id, pose)
                for body_id, (item, pose) in enumerate(zip(items, poses, strict=True), start=1)
            ),
            gaps_m=nearest_gaps_m([Surface(item.mesh) for item in items], poses, gaps),
            contacts=tuple(
                (int(i) + 1, int(j) + 1)
                for i, j in np.argwhere(np.triu(gaps <= config.touch_gap_max_m, k=1))
            ),
            settle_time_s=settle_time_s,
            views=(),
            generator=stood,
        )
    raise SceneError(
        f"{scene_id}: no clutter of level {level} in {config.placement_attempts} tries: {reason}",
        "Raise scenes.placement_attempts, or lower scenes.objects_per_clutter",
    )


def _draws(
    pool: Sequence[CatalogueObject],
    config: ScenesConfig,
    seed: int,
    settled: SettledClutter | None,
) -> Iterator[tuple[list[CatalogueObject], np.random.Generator]]:
    """Objects to try a clutter of, and the generator for the rest: first those settled before."""
    if settled:
        by_key = {item.key: item for item in pool}
        yield [by_key[key] for key in settled.members], generator_at(seed, settled.generator)
    rng = np.random.Generator(np.random.PCG64(seed))
    for _ in range(config.placement_attempts):
        yield draw_items(pool, config.objects_per_clutter, rng), rng


def draw_items(
    pool: Sequence[CatalogueObject], count: int, rng: np.random.Generator
) -> list[CatalogueObject]:
    """Draw ``count`` objects in random order, each as often as any other, give or take one."""
    rounds = [rng.permutation(len(pool)) for _ in range(-(-count // len(pool)))]
    return [pool[int(i)] for i in np.concatenate(rounds)[:count]]


def measure_gaps(
    items: Sequence[CatalogueObject],
    poses: Sequence[Float[np.ndarray, "4 4"]],
    distribution: Distribution,
    config: ScenesConfig,
) -> Float[np.ndarray, "n n"]:
    """Gaps on the true meshes, of far pairs a lower bound, held to the level's definition.

    Parameters
    ----------
    items
        The objects, in the order of their poses.
    poses
        world_from_object of each, at rest.
    distribution
        Isolated, multiple or stacked.
    config
        Section scenes of the run.

    Returns
    -------
    Gap of every pair [m], shape (n, n), inf on the diagonal.

    Raises
    ------
    SceneError
        a gap misses the level, or a body sinks, floats or intersects another.
    """
    needed = {
        Distribution.ISOLATED: config.isolated_gap_min_m,
        Distribution.MULTIPLE: config.multiple_gap_max_m,
        Distribution.STACKED: config.touch_gap_max_m,
    }[distribution]
    surfaces = [Surface(item.mesh) for item in items]
    gaps = pairwise_gaps_m(surfaces, poses, beyond_m=2 * needed)
    _check_table(items, poses, distribution, config)
    _check_overlap(items, poses, gaps, config)
    if len(items) > 1:
        _check_level(gaps.min(axis=1), distribution, config)
    return gaps


def _settle_placed(
    items: Sequence[CatalogueObject],
    distribution: Distribution,
    config: ScenesConfig,
    rng: np.random.Generator,
) -> tuple[list[Float[np.ndarray, "4 4"]], float]:
    """Place objects that rest alone in SE(2), then let all settle together."""
    surfaces = [Surface(item.mesh) for item in items]
    resting = [resting_pose(item, config, rng) for item in items]
    place = place_isolated if distribution is Distribution.ISOLATED else place_multiple
    poses = place(surfaces, resting, config, rng)
    world = new_world(config, render=False)
    bodies = [
        add_body(world, item, pose, body_id, _COLOUR, config)
        for body_id, (item, pose) in enumerate(zip(items, poses, strict=True), start=1)
    ]
    settle_time_s = settle(world, bodies, config)
    return [body.world_from_object for body in bodies], settle_time_s


def _settle_pile(
    items: Sequence[CatalogueObject], config: ScenesConfig, rng: np.random.Generator
) -> tuple[list[Float[np.ndarray, "4 4"]], float]:
    """Drop a pile in SE(3); drop again onto the pile each object that lies apart from it."""
    world, bodies, settle_time_s = drop_pile(items, config, rng)
    surfaces = [Surface(item.mesh) for item in items]
    poses: list[Float[np.ndarray, "4 4"]] = []
    gaps = None
    for _ in range(_DROPS_AGAIN):
        before, poses = poses, [body.world_from_object for body in bodies]
        gaps = pairwise_gaps_m(
            surfaces, poses, 2 * config.touch_gap_max_m, known=gaps, known_poses=before
        )
        off = [body.body_id - 1 for body in fallen_off(bodies, config)]
        apart = off or np.flatnonzero(gaps.min(axis=1) > config.touch_gap_max_m).tolist()
        if not apart or len(items) == 1:
            return poses, settle_time_s
        settle_time_s += drop_again(world, bodies, items, int(apart[0]), config, rng)
    raise SceneError(
        f"After {_DROPS_AGAIN} more drops an object still touched no other",
        "Draw another seed, or raise scenes.touch_gap_max_m",
    )


def _check_table(
    items: Sequence[CatalogueObject],
    poses: Sequence[Float[np.ndarray, "4 4"]],
    distribution: Distribution,
    config: ScenesConfig,
) -> None:
    for item, pose in zip(items, poses, strict=True):
        vertices = item.mesh.transformed(pose).vertices_m
        lowest = float(vertices[:, 2].min())
        if lowest < -config.sink_max_m:
            raise SceneError(
                f"{item.name} sinks {-1e3 * lowest:.2f} mm into the table", "Draw another seed"
            )
        if distribution is not Distribution.STACKED and lowest > config.touch_gap_max_m:
            raise SceneError(f"{item.name} floats {1e3 * lowest:.2f} mm up", "Draw another seed")
        if np.abs(vertices[:, :2]).max() > config.table_side_m / 2:
            raise SceneError(f"{item.name} reaches over the table's edge", "Draw another seed")


def _check_overlap(
    items: Sequence[CatalogueObject],
    poses: Sequence[Float[np.ndarray, "4 4"]],
    gaps: Float[np.ndarray, "n n"],
    config: ScenesConfig,
) -> None:
    for i, j in np.argwhere(np.triu(gaps <= 0.0, k=1)):
        depth = penetration_m(
            items[i].mesh.transformed(poses[i]), items[j].mesh.transformed(poses[j])
        )
        if depth > config.sink_max_m:
            raise SceneError(
                f"{items[i].name} and {items[j].name} intersect by {1e3 * depth:.2f} mm",
                "Draw another seed",
            )


def _check_level(
    nearest_m: Float[np.ndarray, " n"], distribution: Distribution, config: ScenesConfig
) -> None:
    least, greatest = float(nearest_m.min()), float(nearest_m.max())
    if distribution is Distribution.ISOLATED and least < config.isolated_gap_min_m:
        raise SceneError(f"Isolated objects came within {1e3 * least:.1f} mm", "Draw another seed")
    if distribution is Distribution.MULTIPLE and (
        greatest > config.multiple_gap_max_m or least <= 0.0
    ):
        raise SceneError(
            f"Neighbours lie {1e3 * least:.1f} to {1e3 * greatest:.1f} mm apart",
            "Draw another seed",
        )
    if distribution is Distribution.STACKED and greatest > config.touch_gap_max_m:
        raise SceneError(
            f"A stacked object lies {1e3 * greatest:.1f} mm from all others", "Draw another seed"
        )
