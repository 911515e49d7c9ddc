"""Folders that look like runs, with real artifacts of no content."""

import json
from pathlib import Path
from typing import Any

from pipeline.artifacts import ArtifactWriter, Input, Provenance
from pipeline.execution import RunFolder
from pipeline.execution.freshness import Key

STAGES = ("objects", "scenes", "grasps", "shards", "train", "evaluate")


def key_of(stage: str) -> Key:
    return Key({"seed": stage}, {f"stages/{stage}.py": "1"}, {"python": "3.11"}, {})


def make_run(path: Path, toml: str = "") -> RunFolder:
    path.mkdir(parents=True)
    (path / "run.toml").write_text(toml)
    folder = RunFolder(path)
    folder.state("").mkdir()
    return folder


def make_stage(
    folder: RunFolder, stage: str, inputs: tuple[Input, ...] = (), **figures: Any
) -> None:
    key = key_of(stage)
    made = Provenance(
        stage,
        key.digest,
        key.config_digest,
        key.code_digest,
        0,
        inputs,
        "1",
        key_parts=key.to_json(),
    )
    with ArtifactWriter(folder.artifact(stage), made):
        pass
    summary = {"stage": stage, "key": key.digest, "wall_time_s": 10.0, **figures}
    folder.summary(stage).write_text(json.dumps(summary))
    folder.state(f"{stage}.key").write_text(key.to_json() + "what draws")
