"""A stage small enough for tests: it writes one message, and counts how often it ran."""

import os
import time
from pathlib import Path

from pipeline.artifacts import ArtifactWriter
from pipeline.errors import SoftgripError
from pipeline.execution import RunFolder, Stage, StageContext, Summary, stage_command
from schemas.softgrip.v1.objects_pb2 import RefusedMesh

COUNTING = Stage("counting", ("seed", "train"))


def build(stage: StageContext) -> Summary:
    """Count."""
    mood = os.environ.get("MOOD", "")
    if mood == "explained":
        raise SoftgripError("The cup is empty", "Fill it")
    if mood == "surprised":
        raise ZeroDivisionError("by zero")
    if mood == "slow":
        stage.folder.state("slow").touch()
        time.sleep(600)  # until it is interrupted
    stage.recording.write_bytes(b"")
    with ArtifactWriter(stage.output, stage.provenance()) as artifact:
        artifact.write("/x", RefusedMesh(source="x"), log_time_ns=0)
    runs = stage.folder.path / "runs.txt"
    runs.write_text(runs.read_text() + "x" if runs.is_file() else "x")
    return {"count": 1}


def no_inputs(stage: Stage, folder: RunFolder, mesh_dir: Path | None) -> dict[str, Path]:
    """It reads nothing."""
    return {}


if __name__ == "__main__":
    stage_command(COUNTING, build, no_inputs)
