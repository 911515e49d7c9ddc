"""The figures of a finished run that its reference keeps, read from its artifacts."""

from dataclasses import dataclass
from pathlib import Path

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.artifacts.sharding import read_index
from pipeline.clutter.levels import Distribution, level_of
from pipeline.config import load_run_config
from pipeline.execution import RunFolder
from pipeline.gripper import GraspStatus
from pipeline.messages.objects import read_objects
from pipeline.messages.samples import read_split
from pipeline.messages.scenes import read_scenes
from pipeline.regression.comparison import Figures, Value
from pipeline.regression.kept_network import (
    control_predictions,
    error_on,
    predictions,
    read_network,
    read_samples,
)
from pipeline.regression.pads import labelled_pads
from pipeline.regression.spread import trained_figures
from schemas.softgrip.v1.evaluation_pb2 import LevelResult
from schemas.softgrip.v1.scenes_pb2 import Scene
from schemas.softgrip.v1.training_pb2 import Epoch, TrainingResult


@dataclass(frozen=True)
class Kept:
    """The committed files that a run is held against, beside its reference."""

    pads: Path
    network: Path
    samples: Path


def figures_of(run: RunFolder, kept: Kept) -> Figures:
    """All that ``make regress`` compares of a run that is finished up to the training.

    What the closed loop lifted is among them where the closed loop was run.
    """
    return (
        object_figures(run)
        | scene_figures(run)
        | grasp_figures(run)
        | pad_figures(run, kept.pads)
        | kept_network_figures(run, kept)
        | training_figures(run)
        | (success_figures(run) if run.artifact("evaluate").is_file() else {})
    )


def object_figures(run: RunFolder) -> Figures:
    """NSVR, class and split of each object."""
    objects = read_objects(run.artifact("objects"))
    return {
        "nsvr": {name: item.nsvr for name, (item, _) in objects.items()},
        "shape_class": {name: str(item.shape_class) for name, (item, _) in objects.items()},
        "split": {name: split for name, (_, split) in objects.items()},
    }


def scene_figures(run: RunFolder) -> Figures:
    """What lies in each scene, and the gap of each object to its nearest neighbour."""
    placed: dict[str, Value] = {}
    gaps: dict[str, dict[str, Value]] = {"gap_mm": {}, "stacked_gap_mm": {}}
    for scene in read_scenes(run.artifact("scenes")):
        names = [item.object_name for item in scene.objects]
        placed[scene.scene_id] = ", ".join(names)
        stacked = level_of(scene.level)[1] == Distribution.STACKED
        group = gaps["stacked_gap_mm" if stacked else "gap_mm"]
        for item, gap_m in zip(scene.objects, scene.gaps_m, strict=True):
            name = f"{item.object_name} (body {item.body_id}) in {scene.scene_id}"
            group[name] = round(1e3 * float(gap_m), 6)
    return {"placed": placed, **gaps}


def grasp_figures(run: RunFolder) -> Figures:
    """How many labelled grasps there are, and how q is spread."""
    index = read_index(run.artifact("grasps"))
    tenths = from_tensor(index.quality_histogram).tolist()
    return {
        "grasps": {"grasps": index.samples, "scenes with grasps": len(index.shards)},
        "q_histogram": {f"{n / 10:.1f} to {(n + 1) / 10:.1f}": c for n, c in enumerate(tenths)},
    }


def pad_figures(run: RunFolder, pads: Path) -> Figures:
    """q and status of each pad of the fixed shard, labelled as the run is configured."""
    labels = labelled_pads(pads, load_run_config(run.config).gripper)
    names = [f"pad {number}" for number in range(len(labels))]
    return {
        "pad_q": dict(zip(names, labels.q.tolist(), strict=True)),
        "pad_status": {
            name: GraspStatus(status).name.lower()
            for name, status in zip(names, labels.status.tolist(), strict=True)
        },
    }


def kept_network_figures(run: RunFolder, kept: Kept) -> Figures:
    """What the kept network answers for kept samples, and its error on the run's test split."""
    network, samples = read_network(kept.network), read_samples(kept.samples)
    names = [f"sample {number}" for number in range(len(samples))]
    error = error_on(network, read_split(run.artifact("shards"), "test"))
    return {
        "prediction": dict(zip(names, predictions(network, samples).tolist(), strict=True)),
        "control_prediction": dict(
            zip(names, control_predictions(network, samples).tolist(), strict=True)
        ),
        "kept_error": {renderer_of(run): error},
    }


def renderer_of(run: RunFolder) -> str:
    """Whose pictures the run's are: ``sapien`` or ``embree``."""
    with open_artifact(run.artifact("scenes")) as artifact:
        _, scene = next(iter(artifact.messages(Scene)))
    return str(scene.renderer)


def training_figures(run: RunFolder) -> Figures:
    """The network's size, how it learned, and the error of what it has to beat."""
    with open_artifact(run.artifact("train")) as artifact:
        epochs = [message for _, message in artifact.messages(Epoch)]
        result = artifact.one(TrainingResult)
    return {
        "baseline_error": dict(sorted(result.baseline_mae.items())),
        "network": {"layers": result.layers, "parameters": result.parameters},
        "trained": trained_figures(
            [epoch.train_mae for epoch in epochs],
            [epoch.val_mae for epoch in epochs],
            result.test_mae,
        ),
    }


def success_figures(run: RunFolder) -> Figures:
    """Share of the objects in the test clutters that the closed loop lifted, by level."""
    with open_artifact(run.artifact("evaluate")) as artifact:
        levels = [message for _, message in artifact.messages(LevelResult, "/levels")]
    return {"lifted": {f"level {one.level}": one.lifted / one.objects for one in levels}}
