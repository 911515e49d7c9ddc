"""`make regress`: run `ci` held against the committed reference, each difference in words.

`make regress ACCEPT=1` takes the run's figures as the new reference; commit it with the reason.
"""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pipeline.artifacts import publish_bytes, read_provenance
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, generator, run_command
from pipeline.labelling.heights import pad_heights
from pipeline.labelling.poses import pad_of
from pipeline.labelling.rounds import label_rounds
from pipeline.labelling.scene import scene_surfaces, visible_surface
from pipeline.messages.objects import read_objects
from pipeline.messages.scenes import read_scenes
from pipeline.regression.comparison import Figures, compared_count, differences
from pipeline.regression.figures import figures_of
from pipeline.regression.pads import write_pads
from stages.graph import RUNS_DIR

REFERENCE = Path("tests/regression/reference.json")
PADS = Path("tests/regression/pads.mcap")
PADS_A_SCENE = 8  # from the worst label to the best, in a small file
EXIT_DIFFERENT = 1  # what Make takes for a failure


def main(
    run: Annotated[str, typer.Option(help="a finished run")] = "ci",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
    reference: Annotated[Path, typer.Option(help="what it is held against")] = REFERENCE,
    accept: Annotated[bool, typer.Option(help="take the run's figures as reference")] = False,
    new_pads: Annotated[bool, typer.Option(help="draw the fixed pads anew from the run")] = False,
) -> None:
    """Compare a run with the reference; non-zero where something moved further than it may."""
    folder = RunFolder(runs_dir / run)
    if new_pads:
        draw_pads(folder, PADS)
    now = figures_of(folder, PADS)
    before: Figures = {} if accept and not reference.is_file() else read_reference(reference)
    found = list(differences(now, before))
    for difference in found:
        sys.stdout.write(f"{difference}\n")
    if accept:
        publish_bytes(reference, (json.dumps(now, indent=1, ensure_ascii=False) + "\n").encode())
        sys.stdout.write(f"{len(found)} differences accepted: commit {reference} with the reason\n")
        return
    sys.stdout.write(f"{compared_count(now)} quantities compared, {len(found)} differ\n")
    if found:
        sys.stdout.write("If this is meant: make regress ACCEPT=1\n")
        raise typer.Exit(EXIT_DIFFERENT)


def read_reference(path: Path) -> Figures:
    """The committed figures.

    Raises
    ------
    ArtifactError
        There are none.
    """
    if not path.is_file():
        raise ArtifactError(f"{path} does not exist", "Make it: make regress ACCEPT=1")
    figures: Figures = json.loads(path.read_text())
    return figures


def draw_pads(folder: RunFolder, path: Path) -> None:
    """Pads on objects of every scene, from good to bad, with what lies under their vertices."""
    config = load_run_config(folder.config)
    objects = read_objects(folder.artifact("objects"))
    meshes = {name: item.mesh for name, (item, _) in objects.items()}
    pad = pad_of(config.gripper.pad)
    heights, targets = [], []
    for scene in read_scenes(folder.artifact("scenes")):
        surfaces = scene_surfaces(scene, meshes, config.scenes.table_side_m)
        surface = visible_surface(scene.views[0], surfaces, pad.config.radius_m)
        rng = generator(config.seed, "pads", scene.scene_id)
        candidates, labels = label_rounds(surface, surfaces, config, 512, rng)
        wanted = np.linspace(labels.q.min(), labels.q.max(), PADS_A_SCENE)
        chosen = np.abs(labels.q[None, :] - wanted[:, None]).argmin(axis=1)
        frames = candidates.world_from_contact[chosen]
        found, below = pad_heights(frames, surfaces, pad, config.grasps.clearance_m)
        heights.append(found)
        targets.append(below == candidates.body_id[chosen, None])
    made = replace(read_provenance(folder.artifact("scenes")), stage="regress", inputs=())
    write_pads(path, made, np.concatenate(heights), np.concatenate(targets))


if __name__ == "__main__":
    run_command(main)
