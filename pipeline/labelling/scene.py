"""Algorithm 1 on a scene: grasps on every object, proposed from every viewpoint."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import product

import numpy as np

from pipeline.config import RunConfig
from pipeline.errors import SceneError
from pipeline.geometry.mesh import Mesh
from pipeline.gripper import GraspStatus
from pipeline.gripper.limits import LIMIT_NAMES
from pipeline.labelling.clouds import Picture, cut_clouds, measure_pictures
from pipeline.labelling.grasps import GraspOrigin, LabelledGrasps
from pipeline.labelling.rounds import KeptGrasps, sample_grasps, split_evenly
from pipeline.labelling.sampling import Proposal, VisibleSurface
from pipeline.world.cameras import pixel_rays, shown_whole
from pipeline.world.posed_bodies import bodies_at_rest, surfaces_at_rest
from pipeline.world.raycasting import RayScene
from pipeline.world.scene import ClutterScene
from pipeline.world.view import CameraView


def scene_surfaces(
    scene: ClutterScene, meshes: Mapping[str, Mesh], table_side_m: float
) -> RayScene:
    """The true surfaces of a scene's objects and its table, in WCS.

    The pose of each object (S-1.01) is the one in which the physics simulation came to rest.

    Parameters
    ----------
    scene
        The objects and their poses.
    meshes
        Surface of each object by its name, in the object's own frame [m].
    table_side_m
        Side of the table, ``scenes.table_side_m`` [m].

    Returns
    -------
    Surfaces for ray casting; hits name the objects by body id and the table by 0.
    """
    bodies = bodies_at_rest(scene.objects, meshes, table_side_m)
    return surfaces_at_rest(bodies, scene.objects, meshes)


def label_scene(
    scene: ClutterScene,
    surfaces: RayScene,
    config: RunConfig,
    wanted: int,
    rng: np.random.Generator,
) -> list[tuple[GraspOrigin, LabelledGrasps]]:
    """Algorithm 1 on every object of a scene, from each of its viewpoints.

    Parameters
    ----------
    scene
        Objects, their poses, and what its cameras saw.
    surfaces
        Its true surfaces, by `scene_surfaces`.
    config
        Sections grasps, gripper and sensing.
    wanted
        Number of grasps to keep, over all viewpoints.
    rng
        Draws the sensors' noise, the proposals, and which labels are kept.

    Returns
    -------
    A batch of kept grasps for each viewpoint that sees at least one possible contact, in training
    scenes ``grasps.noise_draws`` times: with the noise of the scene's pictures, then with pictures
    of its own. With ``grasps.noise_shared_by`` so few grasps are a batch, with pictures of its own.

    Raises
    ------
    SceneError
        No camera sees a surface face on, whole in its picture and within its range.
    """
    names = tuple(sorted({item.object_name for item in scene.objects}))
    disturbed = config.sensing.disturbed
    measured = measure_pictures(scene.views, disturbed, rng)
    seen = [visible_surface(view, surfaces, config.gripper.pad.radius_m) for view in scene.views]
    able = [
        number
        for number, surface in enumerate(seen)
        if len(surface.contacts(config.grasps.seen_angle_max_rad))
    ]
    if not able:
        raise SceneError(
            f"No camera of scene {scene.scene_id} sees a surface face on, whole in its picture and "
            "neither nearer nor farther than it measures",
            "Raise grasps.seen_angle_max_rad, or change where the cameras stand",
        )
    index_of_body = np.zeros(1 + max(item.body_id for item in scene.objects), dtype=np.int64)
    for item in scene.objects:
        index_of_body[item.body_id] = names.index(item.object_name)
    draws, shared_by = noise_draws(scene.split, config), noise_shared_by(scene.split, config)
    batches = []
    for number, share in zip(able, split_evenly(wanted, len(able)), strict=True):
        kept = sample_grasps(seen[number], surfaces, config, share, rng)
        origin = grasp_origin(scene, scene.views[number].camera.name, names)
        for draw, part in product(range(draws), kept.dealt(shared_by)):
            own = draw > 0 or shared_by > 0
            shown = measure_pictures(scene.views, disturbed, rng) if own else measured
            grasps = add_clouds(part, shown[number], shown, config, rng)
            batches.append((origin, replace(grasps, object_index=index_of_body[grasps.body_id])))
    return batches


def noise_draws(split: str, config: RunConfig) -> int:
    """Clouds that are measured of each grasp in a scene of this split."""
    return config.grasps.noise_draws if split == "train" else 1


def noise_shared_by(split: str, config: RunConfig) -> int:
    """Grasps of one view in a scene of this split that share a draw of noise; 0: all."""
    return config.grasps.noise_shared_by if split == "train" else 0


def visible_surface(view: CameraView, surfaces: RayScene, radius_m: float) -> VisibleSurface:
    """Find the exact surface point and normal at each pixel that shows an object.

    Parameters
    ----------
    view
        An exact picture of the scene.
    surfaces
        The true surfaces; the table is body 0.
    radius_m
        Radius around a contact within which the camera must measure the scene, r_G [m].

    Returns
    -------
    A point and a normal for each pixel that shows an object; none where the picture shows none.
    """
    shown = view.segmentation > 0
    origin, directions = pixel_rays(view.camera, shown)
    hits = surfaces.first_seen(view.camera, shown, directions)
    seen = hits.body > 0
    points = origin + hits.distance_m[seen, None] * directions[seen]
    whole = shown_whole(view.camera, points, radius_m)
    normals = surfaces.normals_at(hits)[seen]
    return VisibleSurface(points, normals, hits.body[seen], origin, whole)


def add_clouds(
    kept: KeptGrasps,
    picture: Picture,
    pictures: list[Picture],
    config: RunConfig,
    rng: np.random.Generator,
) -> LabelledGrasps:
    """Put the kept grasps and the clouds around them into one record.

    Parameters
    ----------
    kept
        Grasps proposed from one view.
    picture
        Measured picture of that view.
    pictures
        Measured pictures of all views.
    config
        Sections sensing, grasps and gripper.
    rng
        Draws which clouds are cut from all pictures.

    Returns
    -------
    The grasps; ``object_index`` is still 0 everywhere.
    """
    candidates, labels = kept.candidates, kept.labels
    frames = candidates.world_from_contact
    cloud, mask, pictures_of_cloud = cut_clouds(frames, picture, pictures, config, rng)
    first_touch = frames.copy()
    first_touch[:, :3, 3] += labels.touch_height_m[:, None] * first_touch[:, :3, 2]
    return LabelledGrasps(
        object_index=np.zeros_like(candidates.body_id),
        body_id=candidates.body_id,
        world_from_gripper=first_touch,
        quality=labels.q,
        pressure=labels.pressure,
        wrench=labels.wrench,
        limit_slack=labels.slacks,
        weight_summary=labels.weights,
        contact_mask=labels.contact,
        status=labels.status - min(GraspStatus),
        iterations=labels.iterations,
        tilt_rad=candidates.tilt_rad,
        proposal=candidates.proposal,
        keep_probability=kept.keep_probability,
        cloud=cloud,
        cloud_mask=mask,
        touch_height_m=labels.touch_height_m,
        pictures=pictures_of_cloud,
    )


def grasp_origin(scene: ClutterScene, viewpoint: str, names: tuple[str, ...]) -> GraspOrigin:
    """Scene, viewpoint and names for a batch of grasps; ``names`` are the scene's objects."""
    return GraspOrigin(
        scene_id=scene.scene_id,
        viewpoint=viewpoint,
        level=scene.level,
        split=scene.split,
        object_names=names,
        limit_names=LIMIT_NAMES,
        status_names=tuple(status.name.lower() for status in GraspStatus),
        proposal_names=tuple(proposal.name.lower() for proposal in Proposal),
    )
