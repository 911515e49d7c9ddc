"""Through Make, on a copy of the project: what changed reruns what depends on it, nothing else."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from pipeline.execution import RunFolder
from pipeline.execution.staleness import is_fresh, stage_context
from stages.graph import STAGES, inputs_of
from tests.stages.conftest import ROOT
from tests.stages.project_copy import copied_unless_gone
from tests.stages.test_pipeline import digests

PROJECT = ("Makefile", "pyproject.toml", "constraints.txt", "pipeline", "stages", "schemas")


@pytest.fixture(scope="module")
def project(run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project with a finished run, free to be edited."""
    copy = tmp_path_factory.mktemp("project")
    for name in PROJECT:
        source = ROOT / name
        if source.is_dir():
            # With what is compiled, which takes long.
            shutil.copytree(source, copy / name, copy_function=copied_unless_gone)
        else:
            shutil.copy2(source, copy / name)
            os.utime(copy / name, (0, 0))  # older than the environment, which is shared
    (copy / ".venv").symlink_to(ROOT / ".venv")
    shutil.copytree(run.path, copy / "runs" / run.path.name)
    return copy


def made(project: Path) -> list[str]:
    """Stages that `make` runs again, in their order."""
    hidden = ("MESH_DIR", "RUN", "WORKERS", "EXECUTOR", "MAKEFLAGS", "MAKELEVEL", "MFLAGS")
    done = subprocess.run(
        ["make", "runs/tiny/evaluate.mcap", "RUN=tiny", "MESH_DIR="],
        cwd=project,
        env={name: value for name, value in os.environ.items() if name not in hidden},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return re.findall(r"^(\w+): done in", done.stderr, re.MULTILINE)


def test_touched_and_reworded_then_edited(project: Path) -> None:
    """One story, since each step starts where the last one ended."""
    folder = RunFolder(project / "runs" / "tiny")
    before = digests(folder)
    for path in [*folder.path.rglob("*"), *(project / "stages").glob("*.py")]:
        os.utime(path)
    source = project / "stages" / "shards.py"
    text = source.read_text()
    assert '"""The stage\'s headline figures."""' in text
    source.write_text(text.replace('"""The stage\'s headline', '"""All headline') + "\n# edited\n")
    assert made(project) == []
    assert digests(folder) == before

    text = folder.config.read_text()
    folder.config.write_text(
        text.replace("attempts_per_clutter = 2", "attempts_per_clutter = 1  # one is enough")
    )
    assert made(project) == ["evaluate"]

    source.write_text(source.read_text() + "\nEDITED = True\n")
    assert made(project) == ["shards", "train", "evaluate"]
    assert made(project) == []
    after = digests(folder)
    kept = {name.split("/")[0].split(".")[0] for name in before if before[name] == after[name]}
    assert kept - {"train"} == {"objects", "scenes", "grasps"}  # equal weights are equal bytes


@pytest.mark.parametrize(
    ("old", "new", "stale"),
    [
        ("seed = 4", "seed = 5", set(STAGES)),
        ("[objects]", "[objects]\ndensity_kg_m3 = 200.0", {"objects"}),
        ("[scenes]", "[scenes]\nfriction = 0.4", {"scenes", "evaluate"}),
        ("count = 240", "count = 300", {"grasps"}),
        ("epochs = 2", "epochs = 3", {"train"}),
        ("[evaluate.policy]", "[evaluate.policy]\nrate_hz = 10.0", {"evaluate"}),
        ("seed = 4", "# a word\nseed = 4", set()),
    ],
)
def test_a_parameter_makes_stale_the_stages_that_read_it(
    run: RunFolder, tmp_path: Path, old: str, new: str, stale: set[str]
) -> None:
    """Of themselves; what lies downstream follows by its input's content."""
    folder = RunFolder(tmp_path / "tiny")
    shutil.copytree(run.path, folder.path)
    text = folder.config.read_text()
    assert old in text
    folder.config.write_text(text.replace(old, new, 1))
    contexts = [stage_context(stage, folder, inputs_of, None, 1) for stage in STAGES.values()]
    assert {context.stage.name for context in contexts if not is_fresh(context)} == stale
