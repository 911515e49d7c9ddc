"""Files of every released version stay readable: a small run of each is kept and read whole.

Made by `make eval` with the run.toml beside them; they are never made again.
"""

from pathlib import Path

import numpy as np
import pytest

from pipeline.artifacts import from_tensor, open_artifact
from pipeline.artifacts.inspection import verify_files
from pipeline.artifacts.sharding import listed_shards, read_index
from pipeline.messages.grasps import read_grasps
from pipeline.messages.objects import read_objects
from pipeline.messages.samples import read_samples
from pipeline.messages.scenes import read_scenes
from pipeline.messages.training import CHECKPOINT, EXPORT
from pipeline.network.checkpoint import load_checkpoint_bytes
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.export import check_export
from pipeline.network.inference import predict
from schemas.compatibility import read_released, versions
from schemas.softgrip.v1.evaluation_pb2 import Attempt, LevelResult
from schemas.softgrip.v1.training_pb2 import Epoch, TrainingResult
from tests.artifacts.readers import by_node, by_us

RELEASED = Path(__file__).parent / "released"


@pytest.fixture(params=sorted(path.name for path in RELEASED.iterdir()))
def released(request: pytest.FixtureRequest) -> Path:
    """The run of one released version."""
    return RELEASED / str(request.param)


def test_every_schema_version_has_a_sample() -> None:
    kept = {path.name.rpartition("-")[0] for path in RELEASED.iterdir()}
    assert {version.name for version in versions()} <= kept


def test_objects_and_scenes(released: Path) -> None:
    objects = read_objects(released / "objects.mcap")
    assert {split for _, split in objects.values()} == {"train", "val", "test"}
    for item, _ in objects.values():
        assert item.nsvr > 2.19
        assert item.mesh.faces.max() < len(item.mesh.vertices_m)
        assert len(item.convex_parts) >= 1
    for scene in read_scenes(released / "scenes.mcap"):
        assert {placed.object_name for placed in scene.objects} <= set(objects)
        for view in scene.views:
            assert (view.depth_m > 0).any()
            assert view.segmentation.max() <= len(scene.objects)


def test_grasps_and_samples(released: Path) -> None:
    quality, samples = [], 0
    for shard in listed_shards(released / "grasps.mcap"):
        with open_artifact(shard) as artifact:
            for origin, grasps in read_grasps(artifact):
                quality.append(grasps.quality)
                assert set(np.unique(grasps.status)) <= set(range(len(origin.status_names)))
    for shard in listed_shards(released / "shards.mcap"):
        with open_artifact(shard) as artifact:
            for found in read_samples(artifact):
                samples += len(found)
                # 0.1.0 cut each cloud from one picture and did not say how grasps were drawn.
                if released.name.endswith("-0.1.0"):
                    assert (found.pictures == 1).all()
                    assert np.isnan(found.proposal_weight).all()
    every = np.concatenate(quality)
    assert every.min() >= 0
    assert every.max() <= 1
    assert len(every) == samples == read_index(released / "grasps.mcap").samples
    assert from_tensor(read_index(released / "grasps.mcap").quality_histogram).sum() == samples


def test_training(released: Path) -> None:
    with open_artifact(released / "train.mcap") as artifact:
        result = artifact.one(TrainingResult)
        assert len(list(artifact.messages(Epoch))) == 2
        network = load_checkpoint_bytes(artifact.attachment(CHECKPOINT))
        predictor = ControlPredictor(artifact.attachment(EXPORT), threads=1)
    assert 0 < result.test_mae < 1
    assert network.config.layers == result.layers
    (shard, *_) = listed_shards(released / "shards.mcap", ["test"])
    with open_artifact(shard) as artifact:
        samples = next(read_samples(artifact))
    # Checkpoint and export agree, and on the samples they were tested on they predict what their
    # run wrote down, which was a mean over the eight symmetries.
    cloud, mask = samples.cloud.copy(), samples.cloud_mask.copy()
    check_export(predictor, network, cloud, mask, batch_size=64, threads=1)
    averaged = predict(network, cloud, mask, 64, 1, average_symmetries=True)
    written = from_tensor(result.test_prediction)[: len(samples)]
    np.testing.assert_allclose(averaged, written, atol=1e-4)


def test_evaluation(released: Path) -> None:
    with open_artifact(released / "evaluate.mcap") as artifact:
        attempts = [message for _, message in artifact.messages(Attempt)]
        levels = [message for _, message in artifact.messages(LevelResult)]
    assert attempts
    assert sum(level.attempts for level in levels) == len(attempts)
    assert from_tensor(attempts[0].gripper_path).shape[1:] == (4, 4)


def test_the_chain_holds_and_typescript_reads_it(released: Path) -> None:
    files = sorted(released.rglob("*.mcap"))
    assert by_node(files) == [by_us(path) for path in files]
    assert [f for f in verify_files(released / "evaluate.mcap", None) if f.problem] == []


def test_every_message_of_its_schema_is_in_a_sample(released: Path) -> None:
    """So that what is kept shows all that was released."""
    carried = set()
    for path in released.rglob("*.mcap"):
        with open_artifact(path) as artifact:
            carried |= {schema for schema, _ in artifact.counts().values()}
    top_level = {
        *("softgrip.v1.CatalogueObject", "softgrip.v1.Scene", "softgrip.v1.GraspBatch"),
        *("softgrip.v1.ShardIndex", "softgrip.v1.SampleBatch", "softgrip.v1.Epoch"),
        *("softgrip.v1.TrainingResult", "softgrip.v1.Attempt", "softgrip.v1.LevelResult"),
    }
    assert top_level <= carried
    assert top_level <= set(read_released(versions()[0]))
