"""Every stage's file is opened by readers in other languages than ours, and by what people use."""

import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rerun.chunk import McapReader

from pipeline.artifacts import open_artifact
from pipeline.errors import MachineError
from pipeline.execution import RunFolder
from pipeline.recording.viewer import off_screen_viewer
from tests.artifacts.readers import TIMEOUT_S, by_node, by_us


@pytest.fixture(scope="module")
def stage_files(run: RunFolder) -> list[Path]:
    """Every artifact of the run, shards included."""
    return sorted(run.path.rglob("*.mcap"))


def test_every_stage_reads_alike_in_typescript(stage_files: list[Path]) -> None:
    """Every message decoded as Foxglove decodes it."""
    assert by_node(stage_files) == [by_us(path) for path in stage_files]


def test_a_stranger_finds_a_description_and_units_of_every_channel(
    stage_files: list[Path],
) -> None:
    """By the TypeScript reader, from the files alone."""
    for path, found in zip(stage_files, by_node(stage_files), strict=True):
        assert found["channels"], path
        for topic, metadata in found["channels"].items():
            assert set(metadata) == {"description", "units"}, (path, topic)
            assert all(metadata.values()), (path, topic)


def test_rust_finds_nothing_wrong(stage_files: list[Path]) -> None:
    """Rerun's own check of structure and timelines."""
    rerun = Path(sys.executable).with_name("rerun")
    for path in stage_files:
        checked = subprocess.run(
            [rerun, "mcap", "check", path],
            capture_output=True,
            text=True,
            check=False,
            timeout=TIMEOUT_S,
        )
        assert checked.returncode == 0, f"{path.name}: {checked.stdout}{checked.stderr}"


# What Rerun makes of Foxglove's messages, to draw them; ours stay whole, as structures.
DRAWN = {
    "foxglove.CameraCalibration": "Pinhole:resolution",
    "foxglove.FrameTransforms": "Transform3D:translation",
    "foxglove.RawImage": "Image:buffer",
}


def component_of(schema: str) -> str:
    """The Rerun component that a message becomes."""
    return DRAWN.get(schema, f"{schema}:message")


def test_rerun_takes_in_every_message(stage_files: list[Path]) -> None:
    """By the loader of its viewer: every topic, every message, decoded by its schema."""
    for path in stage_files:
        with open_artifact(path) as artifact:
            expected = artifact.counts()
        times: dict[str, list[int]] = {topic: [] for topic in expected}
        for chunk in McapReader(path).stream():
            topic, batch = chunk.entity_path, chunk.to_record_batch()
            if topic in expected and not chunk.is_static:
                assert component_of(expected[topic][0]) in batch.schema.names, path
                times[topic] += batch.column("message_log_time").cast("int64").to_pylist()
        for topic, (schema, count) in expected.items():
            # A message of several transforms is as many rows, of one time.
            rows = set(times[topic]) if schema == "foxglove.FrameTransforms" else times[topic]
            assert len(rows) == count, f"{path}: {topic}"


def test_the_viewer_opens_every_stage(stage_files: list[Path]) -> None:
    """The viewer itself, off screen, has all of each file's topics and complains of none."""
    try:
        with off_screen_viewer() as client:
            opened = {path: client.open(str(path)).store_ids for path in stage_files}
            while client.get_state().loading:
                time.sleep(0.1)
            schemas = {path: client.get_recording_schema(id_) for path, (id_,) in opened.items()}
            logs = client.get_logs()
    except MachineError as error:
        pytest.skip(f"the viewer needs a graphics driver: {error}")
    for path, schema in schemas.items():
        shown = {e.entity_path: {c.component for c in e.components} for e in schema.entities}
        with open_artifact(path) as artifact:
            for topic, (message, _) in artifact.counts().items():
                assert component_of(message) in shown[topic], path
    of_files = [entry for entry in logs if entry.target.startswith(("re_importer", "re_mcap"))]
    assert len(of_files) >= len(stage_files)
    assert {entry.level for entry in of_files} == {"INFO"}


def test_go_doctor_finds_nothing_wrong(stage_files: list[Path]) -> None:
    mcap = shutil.which("mcap")
    if mcap is None:
        pytest.skip("the mcap command line is not installed: see 'make doctor'")
    for path in stage_files:
        said = subprocess.run(
            [mcap, "doctor", path], capture_output=True, text=True, check=False, timeout=TIMEOUT_S
        )
        assert said.returncode == 0, said.stderr
