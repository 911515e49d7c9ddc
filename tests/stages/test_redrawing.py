"""What only draws makes the recording anew and leaves the artifact; `make status` says so."""

import ast
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from pipeline.artifacts import file_sha256
from pipeline.execution import RunFolder, StageContext
from pipeline.execution import running as execution
from pipeline.execution.code import DRAWING, reached_modules
from pipeline.execution.freshness import Key
from pipeline.execution.staleness import is_fresh, stage_context, why_stale
from stages.graph import STAGES, inputs_of
from tests.stages.conftest import ROOT, run_stage
from tests.stages.test_pipeline import digests

DRAWN_APART = [name for name, stage in STAGES.items() if stage.drawn_apart]


@pytest.fixture
def folder(run: RunFolder, tmp_path: Path) -> RunFolder:
    """A copy of the finished run."""
    folder = RunFolder(tmp_path / "runs" / run.path.name)
    shutil.copytree(run.path, folder.path)
    return folder


def context_of(folder: RunFolder, stage: str) -> StageContext:
    return stage_context(STAGES[stage], folder, inputs_of, None, 1)


@pytest.mark.parametrize("stage", DRAWN_APART)
def test_a_lost_recording_is_drawn_from_the_artifact_as_it_was(
    folder: RunFolder, stage: str
) -> None:
    before, written = digests(folder), folder.artifact(stage).stat().st_ino
    drawn = folder.recording(stage)
    kept = drawn.rename(drawn.with_suffix(".before.rrd"))
    assert why_stale(context_of(folder, stage)) == ["recording alone: missing"]
    done = run_stage(stage, folder.path.parent, workers=1)
    assert done.returncode == 0, done.stderr[-3000:]
    assert "its recording is drawn anew" in done.stderr
    assert digests(folder) == before
    assert folder.artifact(stage).stat().st_ino == written
    assert is_fresh(context_of(folder, stage))
    assert shown_rows(drawn) == shown_rows(kept)


def shown_rows(recording: Path) -> Counter[str]:
    """Entity → what was logged of it; how it is cut into chunks is up to Rerun's clock."""
    rows: Counter[str] = Counter()
    for chunk in RrdReader(recording).stream():
        rows[chunk.entity_path] += chunk.to_record_batch().num_rows
    return rows


def test_other_drawing_code_draws_anew_and_makes_nothing(
    folder: RunFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    context = context_of(folder, "objects")
    code = {**context.drawing_key.code, "pipeline/recording/colours.py": "another"}
    redrawn = replace(context, drawing_key=replace(context.drawing_key, code=code))
    assert why_stale(redrawn) == ["recording alone: code pipeline/recording/colours.py changed"]
    drawings = []

    def build(stage: StageContext) -> execution.Summary:
        raise AssertionError("the artifact was made again")

    def draw(stage: StageContext, figures: execution.Summary) -> None:
        drawings.append(figures["objects"])

    before = file_sha256(folder.artifact("objects"))
    execution.run_stage(redrawn, build, draw=draw)
    assert drawings == [12]
    assert file_sha256(folder.artifact("objects")) == before
    assert is_fresh(redrawn)


@pytest.mark.parametrize(
    ("machine", "words"),
    [
        ({"python": "3.99.0"}, "python was"),
        ({"numpy": "9.9.9"}, "numpy was"),
        ({"renderer": "Embree rays, if it was not"}, "renderer was"),
    ],
)
def test_another_machine_makes_stale_and_is_told(
    folder: RunFolder, machine: dict[str, str], words: str
) -> None:
    context = context_of(folder, "scenes")
    key: Key = replace(context.key, machine=context.key.machine | machine)
    (reason,) = why_stale(replace(context, key=key))
    assert reason.startswith(words)
    assert reason.endswith(f"is {next(iter(machine.values()))}")


def test_status_tells_each_stage(folder: RunFolder) -> None:
    def told() -> list[str]:
        done = subprocess.run(
            [sys.executable, "-m", "stages.freshness", "status", "--run", folder.path.name],
            cwd=folder.path.parent.parent,
            env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
            capture_output=True,
            text=True,
            check=True,
        )
        return done.stdout.splitlines()

    assert told() == [f"{name:<9} up to date" for name in STAGES]
    folder.recording("scenes").unlink()
    assert told()[1] == "scenes    stale: recording alone: missing"
    assert told()[2].startswith("grasps    up to date")


@pytest.mark.parametrize("stage", DRAWN_APART)
def test_what_draws_is_the_module_that_the_key_follows(stage: str) -> None:
    source = (ROOT / "stages" / f"{stage}.py").read_text()
    assert f"from {STAGES[stage].drawing_module} import draw_{stage}\n" in source.replace(
        "  #", "\n"
    )


@pytest.mark.parametrize("stage", DRAWN_APART)
def test_of_what_draws_a_stage_uses_its_drawing_alone(stage: str) -> None:
    """An artifact's key does not follow `pipeline.recording`, so nothing in it may be from there.

    The table of an evaluation is printed, and written by what draws.
    """
    taken = set()
    for name in reached_modules(STAGES[stage].module):
        path = ROOT.joinpath(*name.split("."))
        source = (
            path.with_suffix(".py") if path.with_suffix(".py").is_file() else path / "__init__.py"
        )
        for node in ast.walk(ast.parse(source.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(DRAWING):
                taken |= {alias.name for alias in node.names}
    tables = {"read_tables"} if stage == "evaluate" else set()
    assert taken <= {f"draw_{stage}"} | tables
