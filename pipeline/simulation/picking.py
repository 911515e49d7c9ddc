"""Emptying one clutter: attempt after attempt in one SAPIEN world, judged by physics."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from pipeline.clutter.scene import ClutterScene, PlacedObject
from pipeline.config import RunConfig
from pipeline.control.policy import Cause, Observation, attempt
from pipeline.geometry.catalogue import CatalogueObject
from pipeline.gripper.pad import build_pad
from pipeline.sensing.cameras import PinholeCamera, points_of_depth, static_cameras
from pipeline.sensing.depth_noise import disturb
from pipeline.sensing.rendering import Renderer, rendered
from pipeline.sensing.sub_cloud import sub_clouds
from pipeline.simulation.engine import Body, add_body, new_world
from pipeline.simulation.gripper_body import FloatingGripper

Predict = Callable[
    [Float[np.ndarray, "n g g 3"], Bool[np.ndarray, "n g g"]], Float[np.ndarray, " n"]
]

_CLOUD_EVERY = 2  # pixels a side between two points that contacts are drawn from
_COLOUR = (0.5, 0.5, 0.5)
_GONE = -0.05  # an object whose centre is lower than this has left the table


@dataclass(frozen=True)
class Attempt:
    """One attempt as it went. Arrays: t samples of b bodies (by id from 1; NaN once gone)."""

    cause: Cause
    target: str
    candidates: int
    predicted_quality: float
    reached_quality: float
    seal_pressure: float
    lifted_height_m: float
    duration_s: float
    world_from_gripper: Float[np.ndarray, "4 4"]
    reached_pose: Float[np.ndarray, "4 4"]
    time_s: Float[np.ndarray, " t"]
    gripper_path: Float[np.ndarray, "t 4 4"]
    object_paths: Float[np.ndarray, "t b 4 4"]
    base_wrench: Float[np.ndarray, "t 6"]
    states: tuple[str, ...]


class SceneSensor:
    """`pipeline.control.policy.Sensor`: the static camera on the world as it is, with noise."""

    def __init__(
        self,
        scene: ClutterScene,
        bodies: dict[int, Body],
        objects: Mapping[str, CatalogueObject],
        renderer: Renderer,
        config: RunConfig,
        rng: np.random.Generator,
    ) -> None:
        self._scene = scene
        self._names = {p.body_id: p.object_name for p in scene.objects}
        self._bodies = bodies
        self._objects = objects
        self._renderer = renderer
        self._config = config
        self._rng = rng
        self.camera: PinholeCamera | None = None

    def look(self) -> Observation:
        """One picture; its points in WCS."""
        present = tuple(
            PlacedObject(self._names[i], i, body.world_from_object)
            for i, body in sorted(self._bodies.items())
        )
        scene = replace(self._scene, objects=present)
        camera = static_cameras(self._config.cameras.static)[0]
        view = rendered(scene, self._objects, (camera,), self._renderer).views[0]
        self.camera = camera
        depth = disturb(view, self._rng) if self._config.sensing.disturbed else view.depth_m
        points, _, _ = points_of_depth(depth, view.camera, _CLOUD_EVERY)
        return Observation(points, view.camera.world_from_camera[:3, 3], depth)


def run_clutter(
    scene: ClutterScene,
    objects: Mapping[str, CatalogueObject],
    renderer: Renderer,
    predict: Predict,
    config: RunConfig,
    rng: np.random.Generator,
) -> list[Attempt]:
    """Attempts until the table is empty, or too many were made or failed in a row."""
    world = new_world(config.scenes, render=False)
    items = {p.body_id: objects[p.object_name] for p in scene.objects}
    bodies = {
        p.body_id: add_body(
            world, items[p.body_id], p.world_from_object, p.body_id, _COLOUR, config.scenes
        )
        for p in scene.objects
    }
    gripper = FloatingGripper(world, bodies, items, build_pad(config.gripper.pad), config)
    sensor = SceneSensor(scene, bodies, objects, renderer, config, rng)

    def score(
        seen: Observation, world_from_contact: Float[np.ndarray, "k 4 4"]
    ) -> Float[np.ndarray, " k"]:
        camera = sensor.camera
        if camera is None:
            raise RuntimeError("scored before the first look")
        radius_m = config.gripper.pad.radius_m
        return predict(
            *sub_clouds(seen.depth_m, camera, world_from_contact, config.sensing, radius_m)
        )

    attempts: list[Attempt] = []
    failures = 0
    while (
        bodies
        and len(attempts) < config.evaluate.attempts_per_clutter
        and failures < config.evaluate.failures_per_clutter
    ):
        gripper.begin()
        decision = attempt(
            sensor, gripper, score, config.evaluate, config.grasps.normal_radius_m, rng
        )
        count = len(scene.objects)
        attempts.append(
            Attempt(
                cause=decision.cause,
                target=items[gripper.target].name if gripper.target else "",
                candidates=decision.candidates,
                predicted_quality=decision.predicted_quality,
                reached_quality=gripper.reached_quality,
                seal_pressure=gripper.seal_pressure,
                lifted_height_m=gripper.lifted_height_m,
                duration_s=gripper.time_s,
                world_from_gripper=decision.world_from_contact,
                reached_pose=gripper.reached_pose,
                time_s=np.array([sample[0] for sample in gripper.samples]),
                gripper_path=np.array([s[1] for s in gripper.samples]).reshape(-1, 4, 4),
                object_paths=np.array(
                    [
                        [s[2].get(i, np.full((4, 4), np.nan)) for i in range(1, count + 1)]
                        for s in gripper.samples
                    ]
                ).reshape(-1, count, 4, 4),
                base_wrench=np.array([s[3] for s in gripper.samples]).reshape(-1, 6),
                states=tuple(s[4] for s in gripper.samples),
            )
        )
        lifted = decision.cause is Cause.LIFTED
        failures = 0 if lifted else failures + 1
        gone = {i for i, body in bodies.items() if body.world_from_object[2, 3] < _GONE}
        for body_id in gone | ({gripper.target} if lifted else set()):
            world.remove_entity(bodies.pop(body_id).entity)
    return attempts
