"""query.rrd: grasps or attempts that a question chose, drawn as the stage's own recording is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pipeline.artifacts import open_artifact
from pipeline.artifacts.sharding import read_index
from pipeline.config import RunConfig
from pipeline.config.grasps import PadConfig
from pipeline.errors import ArtifactError
from pipeline.geometry.mesh import Mesh
from pipeline.gripper import pad_of
from pipeline.labelling.balancing import quality_histogram
from pipeline.labelling.shown_pads import drape_again
from pipeline.messages.grasps import read_grasps
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_placements
from pipeline.recording import evaluate as film
from pipeline.recording import grasps as close_ups
from pipeline.recording.grasps import ShownGrasp
from pipeline.recording.recording import recording
from pipeline.stopwatch import Stopwatch
from pipeline.world.posed_bodies import bodies_at_rest, surfaces_at_rest
from pipeline.world.scene import PlacedObject
from schemas.softgrip.v1.evaluation_pb2 import Attempt

ANSWERED = "in the order of the answer"


@dataclass(frozen=True)
class Chosen:
    """A recording of a choice.

    Attributes
    ----------
    name
        Stage whose recording it is like.
    recording
        Path of the .rrd file.
    recording_id
        Equal for equal choices.
    config
        The run's configuration.
    drawing
        Counts the processor time of drawing.
    """

    name: str
    recording: Path
    recording_id: str
    config: RunConfig
    drawing: Stopwatch = field(default_factory=Stopwatch)


def draw_chosen_grasps(
    chosen: Chosen, artifacts: Mapping[str, Path], grasps: Sequence[tuple[str, int]]
) -> None:
    """Draw grasps, their pads draped again, in the order given.

    Parameters
    ----------
    chosen
        The recording.
    artifacts
        Stage → its artifact: objects, scenes and grasps.
    grasps
        Scene and number within it.
    """
    meshes = _meshes(artifacts)
    placements = read_placements(artifacts["scenes"])
    by_scene: dict[str, list[int]] = {}
    for scene, number in grasps:
        by_scene.setdefault(scene, []).append(number)
    shown: dict[tuple[str, int], ShownGrasp] = {}
    for scene, numbers in by_scene.items():
        if scene not in placements:
            raise ArtifactError(f"There is no scene '{scene}'", "Ask for scenes of this run")
        position = list(placements).index(scene)
        shard = artifacts["grasps"].parent / read_index(artifacts["grasps"]).shards[position].path
        found = _close_ups(shard, scene, placements[scene], numbers, meshes, chosen.config)
        shown |= {(scene, number): one for number, one in zip(numbers, found, strict=True)}
    ordered = [shown[grasp] for grasp in grasps]
    quality = np.array([one.grasps.quality[one.row] for one in ordered])
    with recording(chosen, close_ups.blueprint(ANSWERED, "Of these")) as stream:
        pad = pad_of(chosen.config.gripper.pad)
        close_ups.show_grasps(stream, ordered, meshes, pad, quality_histogram(quality))


def _close_ups(
    shard: Path,
    scene: str,
    placed: tuple[PlacedObject, ...],
    numbers: Sequence[int],
    meshes: Mapping[str, Mesh],
    config: RunConfig,
) -> list[ShownGrasp]:
    """Some grasps of one scene's shard."""
    with open_artifact(shard) as artifact:
        batches = list(read_grasps(artifact))
    rows = [(origin, batch, row) for origin, batch in batches for row in range(len(batch))]
    if {origin.scene_id for origin, _ in batches} != {scene} or max(numbers) >= len(rows):
        raise ArtifactError(
            f"{shard} holds no grasp {max(numbers)} of scene '{scene}'", "Ask again: it changed"
        )
    surfaces = surfaces_at_rest(bodies_at_rest(placed, meshes, config.scenes.table_side_m))
    picked = np.array(numbers, dtype=np.int64)
    pads = drape_again([batch for _, batch in batches], picked, surfaces, config)
    return [
        ShownGrasp(placed, *rows[number], height_m, pressure)
        for number, height_m, pressure in zip(numbers, pads.height_m, pads.pressure, strict=True)
    ]


def draw_chosen_attempts(
    chosen: Chosen, artifacts: Mapping[str, Path], attempts: Sequence[tuple[str, str, int]]
) -> None:
    """Draw attempts as a film, in the order given.

    Parameters
    ----------
    chosen
        The recording.
    artifacts
        Stage → its artifact: objects, scenes and evaluate.
    attempts
        Scene, policy and number of the attempt.
    """
    wanted = set(attempts)
    found: dict[tuple[str, str, int], Attempt] = {}
    with open_artifact(artifacts["evaluate"]) as artifact:
        for _, made in artifact.messages(Attempt):
            name = (made.scene_id, made.policy, made.attempt)
            if name in wanted:
                found[name] = made
    if missing := wanted - found.keys():
        raise ArtifactError(f"There is no attempt {min(missing)}", "Ask for attempts of this run")
    names = {
        scene: [placed.object_name for placed in bodies]
        for scene, bodies in read_placements(artifacts["scenes"]).items()
    }
    config = chosen.config
    scale = config.gripper.pad.radius_m / PadConfig().radius_m
    view = film.blueprint(config.evaluate.robot == "iiwa14", scale)
    made_in_order = [found[name] for name in attempts]
    with recording(chosen, view) as stream:
        text = f"{len(made_in_order)} attempts that a question chose"
        robot = film.shown_robot(config)
        film.show_attempts(stream, made_in_order, names, _meshes(artifacts), text, robot)


def _meshes(artifacts: Mapping[str, Path]) -> dict[str, Mesh]:
    return {name: item.mesh for name, (item, _) in read_objects(artifacts["objects"]).items()}
