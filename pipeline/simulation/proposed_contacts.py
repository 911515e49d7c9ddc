"""Contacts that a policy would propose in a clutter's pictures, with what each is truly worth.

The global phase of `pipeline.control` on the pictures of a scene as it came to rest: the cloud is
merged, contacts are drawn on it, and those are left out at which the stem would collide. Each
ranking then orders the same contacts, and Algorithm 1 labels them on the true surfaces.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from pipeline.config import RunConfig
from pipeline.control.candidates import Candidates, sample_candidates
from pipeline.control.clearance import free_of_collision
from pipeline.control.cloud import DepthPicture, merged_cloud
from pipeline.control.ranking import GeometricRanking, Predict, smooth_quality
from pipeline.geometry.mesh import Mesh
from pipeline.labelling.clouds import Picture, measure_pictures
from pipeline.labelling.poses import label_poses
from pipeline.labelling.scene import scene_surfaces
from pipeline.network.fitted_baselines import pad_seal_ratio
from pipeline.sensing.edges import edge_distance
from pipeline.sensing.sub_cloud import merged_sub_clouds
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene

NETWORK, WITHOUT_NOISE, ANALYTIC = "network", "network, without noise", "analytic"
SEAL_RATIO, GEOMETRIC = "seal ratio", "geometric picker"
BEST_ORDER, ANY_ORDER = "best order", "any order"


@dataclass(frozen=True, eq=False)
class ProposedContacts:
    """Contacts of one scene, k of them.

    Attributes
    ----------
    world_from_contact
        Their frames, shape (k, 4, 4): +z out along the measured mean normal.
    body_id
        What lies under the pad's middle, shape (k,); 0 the table, -1 nothing.
    quality
        q on the true surfaces, shape (k,); 0 on no object.
    tilt_rad
        Angle of the approach off the vertical, shape (k,).
    edge_rg
        Distance to the nearest edge of the measured cloud in units of r_G, shape (k,); inf: none.
    value
        Ranking → what it orders contacts by, the best highest, shape (k,). `BEST_ORDER` is q
        itself, the ceiling; `ANY_ORDER` is that in which they were drawn, the floor.
    predicted
        Predictor → one prediction a contact, shape (k,); of `SEAL_RATIO` the ratio itself.
    worst
        Indices of the contacts that the network errs most on, the worst first, shape (m,).
    worst_cloud
        Their clouds as measured, shape (m, g, g, 3), in units of r_G; NaN where nothing was.
    worst_cloud_without_noise
        The same without the sensors' noise.
    """

    world_from_contact: Float[np.ndarray, "k 4 4"]
    body_id: Int[np.ndarray, " k"]
    quality: Float[np.ndarray, " k"]
    tilt_rad: Float[np.ndarray, " k"]
    edge_rg: Float[np.ndarray, " k"]
    value: Mapping[str, Float[np.ndarray, " k"]]
    predicted: Mapping[str, Float[np.ndarray, " k"]]
    worst: Int[np.ndarray, " m"]
    worst_cloud: Float[np.ndarray, "m g g 3"]
    worst_cloud_without_noise: Float[np.ndarray, "m g g 3"]


def propose_contacts(
    scene: ClutterScene,
    meshes: Mapping[str, Mesh],
    network: Predict,
    analytic: Predict,
    config: RunConfig,
    rng: np.random.Generator,
) -> ProposedContacts:
    """Draw contacts in a scene's pictures, rate them, and label them on the true surfaces.

    Parameters
    ----------
    scene
        A clutter with its exact pictures.
    meshes
        Surface of each object by its name [m].
    network
        Rates clouds.
    analytic
        The baseline that rates clouds.
    config
        Sections evaluate, sensing, gripper, grasps and scenes.
    rng
        Draws the sensors' noise and the contacts.

    Returns
    -------
    The contacts, in the order in which they were drawn.
    """
    measured = measure_pictures(scene.views, config.sensing.disturbed, rng)
    pictures = [DepthPicture(depth, camera) for depth, camera in measured]
    found = _drawn(pictures, config, rng)
    frames = found.world_from_contact
    cloud, seen = _clouds(measured, frames, config)
    exact_cloud, exact_seen = _clouds(measure_pictures(scene.views, False, rng), frames, config)
    predicted = {
        NETWORK: _rated(network, cloud, seen),
        WITHOUT_NOISE: _rated(network, exact_cloud, exact_seen),
        ANALYTIC: _rated(analytic, cloud, seen),
        SEAL_RATIO: pad_seal_ratio(cloud, seen, config.gripper.pad),
    }
    surfaces = scene_surfaces(scene, meshes, config.scenes.table_side_m)
    body_id, quality = _labelled(frames, surfaces, config)
    worst = np.argsort(-np.abs(predicted[NETWORK] - quality), kind="stable")
    worst = worst[: config.evaluate.precision.shown]
    return ProposedContacts(
        world_from_contact=frames,
        body_id=body_id,
        quality=quality,
        tilt_rad=np.arccos(np.clip(frames[:, 2, 2], -1.0, 1.0)),
        edge_rg=edge_distance(cloud, seen),
        value=_values(pictures, found, predicted, quality, config),
        predicted=predicted,
        worst=worst,
        worst_cloud=np.where(seen[worst][..., None], cloud[worst], np.nan),
        worst_cloud_without_noise=np.where(
            exact_seen[worst][..., None], exact_cloud[worst], np.nan
        ),
    )


def _drawn(
    pictures: Sequence[DepthPicture], config: RunConfig, rng: np.random.Generator
) -> Candidates:
    """Contacts as the global phase draws them, at which the stem is free."""
    policy = config.evaluate.policy
    cloud = merged_cloud(pictures, policy.voxel_m, policy.above_table_m)
    wanted, radius_m = config.evaluate.precision.contacts, config.grasps.normal_radius_m
    found = sample_candidates(cloud, wanted, radius_m, policy.tilt_max_rad, rng)
    hand = config.evaluate.hand
    return found.take(free_of_collision(found.world_from_contact, cloud.points_m, hand))


def _clouds(
    pictures: Sequence[Picture], frames: Float[np.ndarray, "k 4 4"], config: RunConfig
) -> tuple[Float[np.ndarray, "k g g 3"], Bool[np.ndarray, "k g g"]]:
    return merged_sub_clouds(pictures, frames, config.sensing, config.gripper.pad.radius_m)


def _rated(
    predict: Predict, cloud: Float[np.ndarray, "k g g 3"], seen: Bool[np.ndarray, "k g g"]
) -> Float[np.ndarray, " k"]:
    if len(cloud) == 0:
        return np.empty(0)
    return np.asarray(predict(cloud, seen), dtype=np.float64)


def _values(
    pictures: Sequence[DepthPicture],
    found: Candidates,
    predicted: Mapping[str, Float[np.ndarray, " k"]],
    quality: Float[np.ndarray, " k"],
    config: RunConfig,
) -> dict[str, Float[np.ndarray, " k"]]:
    """What each ranking orders by; predictions are smoothed over neighbours, as policies do."""
    policy = config.evaluate.policy
    values = {
        name: smooth_quality(found, predicted[name], policy.smoothing_m, policy.smoothing_tilt_rad)
        for name in (NETWORK, ANALYTIC, SEAL_RATIO)
    }
    picker = GeometricRanking(policy.picker, config.sensing, config.gripper.pad)
    return values | {
        GEOMETRIC: picker(pictures, found) if len(found) else np.empty(0),
        BEST_ORDER: quality,
        ANY_ORDER: np.zeros(len(found)),
    }


def _labelled(
    frames: Float[np.ndarray, "k 4 4"], surfaces: RayScene, config: RunConfig
) -> tuple[Int[np.ndarray, " k"], Float[np.ndarray, " k"]]:
    """What lies under each pad's middle, and q for it."""
    clearance_m = config.grasps.clearance_m
    origins = frames[:, :3, 3] + clearance_m * frames[:, :3, 2]
    body_id = surfaces.cast(origins, -frames[:, :3, 2]).body.astype(np.int64)
    labels = label_poses(frames, body_id, surfaces, config.gripper, clearance_m)
    return body_id, np.where(body_id > 0, labels.q, 0.0)
