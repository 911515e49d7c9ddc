"""Recordings read back through Rerun's own reader hold what the artifacts hold."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rerun.chunk import RrdReader

from pipeline.artifacts import open_artifact
from pipeline.artifacts.tensors import from_tensor
from pipeline.execution import RunFolder
from pipeline.messages.grasps import read_grasps
from pipeline.messages.scenes import read_scenes
from schemas.softgrip.v1.grasps_pb2 import ShardIndex
from schemas.softgrip.v1.training_pb2 import Epoch

TIMELESS = -1


def logged(recording: Path, entity: str, column: str, timeline: str) -> dict[int, Any]:
    """Step (or TIMELESS) → what one column of an entity holds there."""
    values: dict[int, Any] = {}
    for chunk in RrdReader(recording).stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path == entity and column in batch.schema.names:
            timeless = timeline not in batch.schema.names
            steps = [TIMELESS] * batch.num_rows if timeless else batch[timeline].to_pylist()
            values |= dict(zip(steps, batch[column].to_pylist(), strict=True))
    return values


def test_scenes_poses_and_depth(run: RunFolder) -> None:
    path = run.recording("scenes")
    scenes = list(read_scenes(run.artifact("scenes")))
    for camera in ("static_0", "wrist_0", "wrist_1"):
        depth = logged(path, f"/world/{camera}/depth", "DepthImage:buffer", "scene")
        assert sorted(depth) == list(range(len(scenes)))
        for step, scene in enumerate(scenes):
            (view,) = (v for v in scene.views if v.camera.name == camera)
            (buffer,) = depth[step]
            shown = np.frombuffer(bytes(buffer), np.float16).reshape(view.depth_m.shape)
            np.testing.assert_array_equal(shown, view.depth_m.astype(np.float16))
    for step, scene in enumerate(scenes):
        for placed in scene.objects:
            entity = f"/world/objects/{step:04d}/{placed.body_id:02d}"
            (position,) = logged(path, entity, "Transform3D:translation", "scene")[step]
            np.testing.assert_allclose(position, placed.world_from_object[:3, 3], atol=1e-6)


def test_grasps_histogram_and_labels(run: RunFolder) -> None:
    path = run.recording("grasps")
    with open_artifact(run.artifact("grasps")) as artifact:
        index = artifact.one(ShardIndex)
    (bars,) = logged(path, "/curves/quality", "BarChart:values", "grasp")[TIMELESS]
    shown = np.asarray(bars["buffer"] if isinstance(bars, dict) else bars, dtype=np.float64)
    np.testing.assert_allclose(shown.ravel(), from_tensor(index.quality_histogram))
    quality: list[float] = []
    for entry in index.shards:
        with open_artifact(run.path / entry.path) as shard:
            for _, grasps in read_grasps(shard, clouds=False):
                quality += grasps.quality.tolist()
    labels = logged(path, "/curves/label/q", "Scalars:scalars", "grasp")
    assert sorted(labels) == list(range(len(labels)))
    for (value,) in labels.values():
        assert np.abs(np.array(quality) - value).min() < 1e-6


def test_training_curve(run: RunFolder) -> None:
    with open_artifact(run.artifact("train")) as artifact:
        epochs = [message for _, message in artifact.messages(Epoch)]
    curve = logged(run.recording("train"), "/curves/error/val", "Scalars:scalars", "epoch")
    shown = [value for step, (value,) in sorted(curve.items()) if step != TIMELESS]
    assert shown == pytest.approx([message.val_mae for message in epochs])
