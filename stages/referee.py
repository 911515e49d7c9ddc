"""`make referee`: the label, and what else scores grasps, against what the referee finds borne.

Scenes and grasps are made in a run of their own, ``runs/<run>/referee``, nothing of the run is.
There: referee.summary.json, .md, .csv (a line a grasp), calibration.svg, and referee.rrd, which
shows where label and referee disagree most.
"""

import json
import os
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from pipeline.artifacts import publish_bytes, read_provenance
from pipeline.config import RunConfig, load_run_config
from pipeline.config.judged import judged_config
from pipeline.config.written import as_toml
from pipeline.execution import RunFolder, generator, progress, run_command, run_in_order
from pipeline.messages.grasp_columns import GraspColumns, read_columns
from pipeline.messages.scenes import read_placed
from pipeline.network.analytic import fit_analytic
from pipeline.recording.recording import recording
from pipeline.recording.referee import blueprint, show_seals, shown_seal
from pipeline.referee import judging
from pipeline.referee.agreement import figures_of, most_apart, varied
from pipeline.referee.seal import referee_of
from pipeline.reporting.agreement import as_csv, as_markdown
from pipeline.reporting.plots import load_by_quality
from pipeline.stopwatch import Stopwatch
from pipeline.world.scene import PlacedObject
from stages.evaluate import catalogue, network
from stages.graph import RUNS_DIR

NAME = "referee"
Columns = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class SceneJob:
    """One work item: chosen grasps of one scene, and which of them are varied too."""

    scene: int
    pose: np.ndarray
    body_id: np.ndarray
    varied: np.ndarray
    folder: RunFolder
    config: RunConfig


@dataclass(frozen=True)
class Recorded:
    """`pipeline.recording.recording.Recorded`."""

    recording: Path
    recording_id: str
    name: str = NAME
    drawing: Stopwatch = field(default_factory=Stopwatch)


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RunName = Annotated[str, typer.Option(envvar="RUN", help="name of the run")]
CORES = len(os.sched_getaffinity(0))  # a worker each, as in stages
RunsDir = Annotated[Path, typer.Option(help="folder of all runs")]
Workers = Annotated[int, typer.Option(envvar="WORKERS", min=1, help="worker processes")]


@app.command()
def prepare(run: RunName = "default", runs_dir: RunsDir = RUNS_DIR) -> None:
    """Write the run.toml of the scenes and grasps that are judged."""
    config = judged_config(load_run_config(RunFolder(runs_dir / run).config))
    publish_bytes(RunFolder(runs_dir / run / NAME).config, as_toml(config).encode())


@app.command()
def judge(run: RunName = "default", workers: Workers = CORES, runs_dir: RunsDir = RUNS_DIR) -> None:
    """Judge an even choice of the grasps and say how far each score tells what they bear."""
    began = time.perf_counter()
    folder = RunFolder(runs_dir / run / NAME)
    config = load_run_config(folder.config)
    wanted, rng = config.agreement, generator(config.seed, NAME)
    grasps = read_columns(folder.artifact("grasps"))
    names, objects = np.unique(grasps.object_name, return_inverse=True)
    chosen = judging.chosen_evenly(grasps.quality, objects, wanted.grasps, rng)  # scene by scene
    again = judging.chosen_evenly(grasps.quality[chosen], objects[chosen], wanted.varied, rng)
    among = np.isin(np.arange(len(chosen)), again)
    jobs = [
        SceneJob(
            int(scene), grasps.world_from_gripper[rows], grasps.body_id[rows], some, folder, config
        )
        for scene in np.unique(grasps.scene[chosen])
        for here in [grasps.scene[chosen] == scene]
        for rows, some in [(chosen[here], among[here])]
    ]
    done = run_in_order(judge_scene, jobs, workers)
    parts = list(progress(done, len(jobs), "referee: judged", "scene"))
    found: Columns = {n: np.concatenate([part[0][n] for part in parts]) for n in parts[0][0]}
    scores = {"q": grasps.quality[chosen], "p of Eq. (2)": grasps.pressure[chosen]}
    scores["label on the measured cloud"] = analytic(grasps, chosen, config)
    scores |= predicted(RunFolder(runs_dir / run), grasps, chosen)
    among_n = {name: np.concatenate([part[1][name] for part in parts]) for name in parts[0][1]}
    figures = {
        **figures_of(scores, found, objects[chosen], wanted, rng),
        "varied": varied(scores["q"][among], found["borne_n"][among], among_n, wanted),
        "ms_a_grasp": 1e3 * float(found.pop("seconds").mean()),
        "wall_time_s": time.perf_counter() - began,
    }
    columns = {"object": names[objects[chosen]], "scene": grasps.scene[chosen], **scores, **found}
    files = {"summary.json": json.dumps(figures, indent=1) + "\n", "csv": as_csv(columns)}
    for ending, data in (files | {"md": as_markdown(figures)}).items():
        publish_bytes(folder.path / f"{NAME}.{ending}", data.encode())
    publish_bytes(folder.path / "calibration.svg", load_by_quality(figures["by_tenth"]).encode())
    apart = most_apart(scores["q"], found["borne_n"], wanted.shown)
    show(folder, config, grasps, chosen[apart], {n: column[apart] for n, column in columns.items()})
    sys.stdout.write(as_markdown(figures))


def predicted(run: RunFolder, grasps: GraspColumns, rows: np.ndarray) -> Columns:
    """The run's network, if it has one; and the same on objects it was not trained on."""
    if not run.artifact("train").is_file():
        return {}
    score = network(run.artifact("train")).predict(grasps.cloud[rows], grasps.cloud_mask[rows])
    objects = catalogue(run.artifact("objects"))
    unseen = np.array([objects.get(n, (0, ""))[1] != "train" for n in grasps.object_name[rows]])
    return {"q-hat": score, "q-hat, unseen objects": np.where(unseen, score, np.nan)}


def analytic(grasps: GraspColumns, rows: np.ndarray, config: RunConfig) -> np.ndarray:
    """The analytic baseline, fitted to grasps that are not judged."""
    others = np.setdiff1d(np.arange(len(grasps.quality)), rows)
    fit = generator(config.seed, NAME, "fit").permutation(others)[: config.agreement.fitted]
    cloud, mask = grasps.cloud, grasps.cloud_mask
    found = fit_analytic(cloud[fit], mask[fit], grasps.quality[fit], config.gripper)
    return found.predict(cloud[rows], mask[rows])


def scene_of(job: SceneJob) -> tuple[judging.Placed, tuple[PlacedObject, ...], np.ndarray]:
    """The scene for the referee, what lies in it, and of each grasp which of it is meant."""
    there = read_placed(job.folder.artifact("scenes"), job.scene)
    objects = catalogue(job.folder.artifact("objects"))
    scene = judging.placed(
        [objects[one.object_name][0].mesh for one in there],
        [one.world_from_object for one in there],
        job.config.scenes.table_side_m,
        job.config.grasps.clearance_m,
    )
    index = {one.body_id: number for number, one in enumerate(there)}
    return scene, there, np.array([index[int(body)] for body in job.body_id])


def judge_scene(job: SceneJob) -> tuple[Columns, Columns]:
    """What the chosen grasps bear, and the varied ones under each variation."""
    scene, _, bodies = scene_of(job)
    referee, radius_m, some = job.config.referee, job.config.gripper.pad.radius_m, job.varied
    began = time.process_time()
    columns = dict(vars(judging.judged(referee, radius_m, scene, job.pose, bodies)))
    columns["seconds"] = np.full(len(bodies), (time.process_time() - began) / len(bodies))
    return columns, {
        f"{name} x {factor:g}": judging.weights_borne_n(
            changed, radius_m, scene, job.pose[some], bodies[some]
        )
        for name, factor, changed in judging.variations(referee)
    }


def show(
    folder: RunFolder, config: RunConfig, grasps: GraspColumns, rows: np.ndarray, columns: Columns
) -> None:
    """The recording of some grasps, in their order; ``columns`` of these alone."""
    objects = catalogue(folder.artifact("objects"))
    pad = referee_of(config.referee, config.gripper.pad.radius_m)
    shown = []
    for number, row in enumerate(rows):
        one = np.array([row])
        pose, body_id = grasps.world_from_gripper[one], grasps.body_id[one]
        job = SceneJob(int(grasps.scene[row]), pose, body_id, one < 0, folder, config)
        scene, there, bodies = scene_of(job)
        seal = judging.sealed(config.referee, pad.disc.radius_m, scene, pose[0], int(bodies[0]))
        shown.append(
            shown_seal(
                [objects[placed.object_name][0] for placed in there],
                [placed.world_from_object for placed in there],
                int(bodies[0]),
                pose[0],
                seal,
                float(columns["borne_n"][number]),
                {n: float(c[number]) for n, c in columns.items() if c.dtype.kind == "f"},
            )
        )
    key = read_provenance(folder.artifact("grasps")).key
    with recording(Recorded(folder.recording(NAME), key), blueprint()) as stream:
        show_seals(stream, shown, pad.disc, pad.fan.vacuum_pa)


if __name__ == "__main__":
    run_command(app)
