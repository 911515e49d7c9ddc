"""`make regress`: run `ci` held against the committed reference, each difference in words.

`make regress ACCEPT=1` takes the run's figures as the new reference; commit it with the reason.
`make regress AFRESH=embree` makes pictures, labels and a training anew in a scratch folder, with
this process's instruction set and that renderer, and compares these.
"""

import json
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from shutil import copy
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
import typer

from pipeline.artifacts import publish_bytes, read_provenance
from pipeline.config import load_run_config
from pipeline.config.cameras import RendererName
from pipeline.errors import ArtifactError, SoftgripError
from pipeline.execution import RunFolder, generator, run_command
from pipeline.gripper import pad_of
from pipeline.labelling.heights import pad_heights
from pipeline.labelling.rounds import label_rounds
from pipeline.labelling.scene import scene_surfaces, visible_surface
from pipeline.messages.objects import read_objects
from pipeline.messages.samples import read_split
from pipeline.messages.scenes import read_scenes
from pipeline.messages.training import CHECKPOINT
from pipeline.regression.comparison import Figures, compared_count, differences
from pipeline.regression.figures import Kept, figures_of
from pipeline.regression.kept_network import spread_over_quality, write_samples
from pipeline.regression.pads import write_pads
from pipeline.regression.spread import read_spread, success_reference, training_reference
from stages.graph import RUNS_DIR

FOLDER = Path("tests/regression")
REFERENCE = FOLDER / "reference.json"
SPREAD = FOLDER / "training_spread.json"
PADS = FOLDER / "pads.mcap"
KEPT = Kept(PADS, FOLDER / "network.safetensors", FOLDER / "samples.mcap")
PADS_A_SCENE = 8  # from the worst label to the best, in a small file
SAMPLES_KEPT = 32  # some 100 kB
EXIT_DIFFERENT = 1  # what Make takes for a failure
MADE_AFRESH = ("scenes", "grasps", "shards", "train")
MEASURED_APART = ("trained", "lifted")  # their reference is the measured spread
BY_RENDERER = ("kept_error",)


def main(
    run: Annotated[str, typer.Option(help="a finished run")] = "ci",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
    reference: Annotated[Path, typer.Option(help="what it is held against")] = REFERENCE,
    accept: Annotated[bool, typer.Option(help="take the run's figures as reference")] = False,
    afresh: Annotated[
        RendererName | None,
        typer.Option(help="compare what is made anew from the run's objects, with this renderer"),
    ] = None,
    new_pads: Annotated[bool, typer.Option(help="draw the fixed pads anew from the run")] = False,
    new_network: Annotated[
        bool, typer.Option(help="keep the run's network, and samples of its test split")
    ] = False,
) -> None:
    """Compare a run with the reference; non-zero where something moved further than it may."""
    folder = RunFolder(runs_dir / run)
    if new_pads:
        draw_pads(folder, PADS)
    if new_network:
        keep_network(folder, KEPT)
    if afresh is None:
        now = figures_of(folder, KEPT)
    else:
        with made_afresh(folder, afresh) as made:
            now = figures_of(made, KEPT)
    kept: Figures = {} if accept and not reference.is_file() else read_reference(reference)
    before = kept | measured_reference(SPREAD, closed_loop="lifted" in now)
    found = list(differences(now, before))
    for difference in found:
        sys.stdout.write(f"{difference}\n")
    if accept:
        taken = accepted(now, kept, BY_RENDERER if afresh else tuple(now))
        publish_bytes(reference, (json.dumps(taken, indent=1, ensure_ascii=False) + "\n").encode())
        sys.stdout.write(f"{len(found)} differences told: commit {reference} with the reason\n")
        return
    sys.stdout.write(f"{compared_count(now)} quantities compared, {len(found)} differ\n")
    if found:
        sys.stdout.write("If this is meant: make regress ACCEPT=1\n")
        raise typer.Exit(EXIT_DIFFERENT)


def read_reference(path: Path) -> Figures:
    """The committed figures, by group and name; ArtifactError where there are none."""
    if not path.is_file():
        raise ArtifactError(f"{path} does not exist", "Make it: make regress ACCEPT=1")
    figures: Figures = json.loads(path.read_text())
    return figures


def measured_reference(path: Path, closed_loop: bool) -> Figures:
    """Bounds of what a training decides, by the measured spread."""
    trainings = read_spread(path)
    return training_reference(trainings) | (success_reference(trainings) if closed_loop else {})


def accepted(now: Figures, kept: Figures, groups: tuple[str, ...]) -> Figures:
    """The reference with some groups of the run's figures in it; other renderers' bounds stay."""
    taken = dict(kept)
    for group in groups:
        if group not in MEASURED_APART:
            older = kept.get(group, {}) if group in BY_RENDERER else {}
            taken[group] = older | now[group]
    return taken


@contextmanager
def made_afresh(source: RunFolder, renderer: RendererName) -> Iterator[RunFolder]:
    """The run up to its training, made from its objects in a folder that is removed afterwards.

    Parameters
    ----------
    source
        A finished run: its configuration and objects are taken.
    renderer
        What draws the pictures.

    Yields
    ------
    RunFolder
        The new run.

    Raises
    ------
    SoftgripError
        a stage failed.
    """
    with TemporaryDirectory(prefix="softgrip-regress-") as scratch:
        folder = RunFolder(Path(scratch) / source.path.name)
        folder.path.mkdir()
        text = source.config.read_text()
        folder.config.write_text(f'{text}\n[cameras]\nrenderer = "{renderer}"\n')
        copy(source.artifact("objects"), folder.artifact("objects"))
        for stage in MADE_AFRESH:
            command = [sys.executable, "-m", f"stages.{stage}", "--run", folder.path.name]
            done = subprocess.run([*command, "--runs-dir", scratch], check=False)
            if done.returncode != 0:
                raise SoftgripError(
                    f"stage {stage} failed in a scratch folder (exit {done.returncode})",
                    "Mend what it says above",
                )
        yield folder


def keep_network(folder: RunFolder, kept: Kept) -> None:
    """The run's trained network, and samples of its test split from the worst to the best."""
    kept.network.write_bytes((folder.path / "train" / CHECKPOINT).read_bytes())
    samples = read_split(folder.artifact("shards"), "test")
    made = replace(read_provenance(folder.artifact("shards")), stage="regress", inputs=())
    write_samples(kept.samples, made, spread_over_quality(samples, SAMPLES_KEPT))


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
