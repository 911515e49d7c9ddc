"""Every command that the pages show runs, on a tiny run in a copy of the project."""

import shutil
import subprocess
from pathlib import Path

import pytest
import trimesh

from pipeline.config import load_run_config
from pipeline.execution import RunFolder
from tests.docs.pages import PAGES, REDUCED, ROOT, as_run, blocks_of
from tests.stages.project_copy import copied_project, quiet_environment

SHOWN_RUNS = ("ci", "default")
# Its commands make run ci from nothing but cut objects; those of other pages find a tiny one made.
FROM_COLD = "README.md"


@pytest.fixture(scope="module")
def copy(run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project, with a tiny run in the place of those that the pages name, and some meshes."""
    copy = copied_project(tmp_path_factory.mktemp("copy") / "softgrip")
    shutil.copytree(ROOT / "runs" / "pictures", copy / "runs" / "pictures")
    for name in SHOWN_RUNS:
        shutil.copytree(run.path, copy / "runs" / name)
    # Convex parts are a cache beside all runs; how they are made cold has tests of its own.
    shutil.copytree(run.path.parent / ".cache", copy / "runs" / ".cache")
    for config in (ROOT / "runs").glob("*/run.toml"):
        if config.parent.name not in SHOWN_RUNS:
            shutil.copytree(config.parent, copy / "runs" / config.parent.name, ignore=only_config)
    meshes = copy / "meshes"
    meshes.mkdir()
    trimesh.creation.box(extents=(0.1, 0.06, 0.04)).export(meshes / "box.stl")
    trimesh.creation.cylinder(radius=30, height=100).export(meshes / "can.obj")
    (meshes / "can.urdf").write_text(
        '<robot name="can"><link name="l"><visual><geometry>'
        '<mesh filename="can.obj" scale="0.001"/></geometry></visual></link></robot>'
    )
    return copy


def only_config(folder: str, names: list[str]) -> list[str]:
    return [name for name in names if name != "run.toml"]


@pytest.mark.parametrize("page", PAGES)
def test_every_command_of_a_page_runs(copy: Path, page: str) -> None:
    environment = quiet_environment()
    if page == FROM_COLD:
        for made in (copy / "runs" / "ci").iterdir():
            if made.name != "run.toml":
                shutil.rmtree(made) if made.is_dir() else made.unlink()
    blocks, no_driver = blocks_of(page), False
    assert blocks
    for block in blocks:
        done = subprocess.run(
            ["bash", "-euo", "pipefail", "-c", as_run(block)],
            cwd=copy,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if "Rerun viewer does not start" in done.stderr:
            no_driver = True
            continue
        assert done.returncode == 0, f"{block}\n{done.stdout[-2000:]}\n{done.stderr[-3000:]}"
    if no_driver:
        pytest.skip("all commands ran but those of the viewer, which needs a graphics driver")


def test_what_is_reduced_is_still_shown() -> None:
    shown = {line for page in PAGES for block in blocks_of(page) for line in block.splitlines()}
    commands = {line.partition("  #")[0].rstrip() for line in shown}
    assert set(REDUCED) <= commands


def test_configuration_shown_is_valid(tmp_path: Path) -> None:
    blocks = [block for page in PAGES for block in blocks_of(page, "toml")]
    assert blocks
    for number, block in enumerate(blocks):
        path = tmp_path / f"{number}.toml"
        path.write_text(block)
        load_run_config(path)
