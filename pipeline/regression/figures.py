"""The figures of a finished run that its reference keeps, read from its artifacts."""

import json
from pathlib import Path

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.artifacts.sharding import read_index
from pipeline.clutter.levels import Distribution, level_of
from pipeline.config import load_run_config
from pipeline.execution import RunFolder
from pipeline.gripper import GraspStatus
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.regression.comparison import Figures, Value
from pipeline.regression.pads import labelled_pads
from schemas.softgrip.v1.training_pb2 import TrainingResult


def figures_of(run: RunFolder, pads: Path) -> Figures:
    """All that ``make regress`` compares."""
    return (
        object_figures(run)
        | scene_figures(run)
        | grasp_figures(run)
        | pad_figures(run, pads)
        | training_figures(run)
        | success_figures(run)
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


def training_figures(run: RunFolder) -> Figures:
    """The network's size, and its error beside that of what it has to beat."""
    with open_artifact(run.artifact("train")) as artifact:
        result = artifact.one(TrainingResult)
    errors = {"test MAE": result.test_mae}
    errors |= {f"test MAE of baseline {n}": v for n, v in sorted(result.baseline_mae.items())}
    return {
        "network": {"layers": result.layers, "parameters": result.parameters},
        "error": dict(errors),
    }


def success_figures(run: RunFolder) -> Figures:
    """Success by level with its 95 % interval, within which it may move."""
    by_level = json.loads(run.summary("evaluate").read_text())["success_by_level"]
    names = {level: f"level {level}" for level in sorted(by_level)}
    return {
        "success": {name: by_level[level]["rate"] for level, name in names.items()},
        "success_low": {n: by_level[level]["interval_95"][0] for level, n in names.items()},
        "success_high": {n: by_level[level]["interval_95"][1] for level, n in names.items()},
    }
