"""`make referee`: the label, and what else scores grasps, against what the referee finds borne.

All is made in a run of its own, ``runs/<run>/referee``: referee.summary.json, .md, .csv (a line a
grasp), calibration.svg, and referee.rrd of grasps that label and referee see most differently.
"""

import json
import os
import sys
import time
from dataclasses import dataclass
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
from pipeline.messages.objects import catalogue
from pipeline.messages.scenes import read_placed
from pipeline.messages.trained import SCORE_THREADS, control_predictor
from pipeline.network.analytic import fit_analytic
from pipeline.network.sources import RELEASED, quality_source
from pipeline.recording.recording import OwnRecording, recording
from pipeline.recording.referee import blueprint, show_seals, shown_seal
from pipeline.referee import judging
from pipeline.referee.agreement import figures_of, most_apart, varied
from pipeline.referee.seal import referee_of
from pipeline.reporting.agreement import as_csv, as_markdown
from pipeline.reporting.plots import load_by_quality
from pipeline.world.scene import PlacedObject
from stages.graph import RUNS_DIR

NAME = "referee"
Columns = dict[str, np.ndarray]


@dataclass(frozen=True, eq=False)
class SceneJob:
    """Chosen grasps of one scene, and which of them are varied too."""

    scene: int
    pose: np.ndarray
    body_id: np.ndarray
    varied: np.ndarray
    folder: RunFolder
    config: RunConfig


app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RunName = Annotated[str, typer.Option(envvar="RUN", help="name of the run")]
CORES = len(os.sched_getaffinity(0))  # a worker each, as in stages
RunsDir = Annotated[Path, typer.Option(help="folder of all runs")]
Workers = Annotated[int, typer.Option(envvar="WORKERS", min=1, help="worker processes")]


@app.command()
def prepare(run: RunName = "default", runs_dir: RunsDir = RUNS_DIR) -> None:
    """Write the run.toml of the scenes and grasps that are judged; by defaults without a run's."""
    own = RunFolder(runs_dir / run).config
    config = judged_config(load_run_config(own) if own.is_file() else RunConfig())
    publish_bytes(RunFolder(runs_dir / run / NAME).config, as_toml(config).encode())


@app.command()
def judge(run: RunName = "default", workers: Workers = CORES, runs_dir: RunsDir = RUNS_DIR) -> None:
    """Judge an even choice of the grasps and say how far each score tells what they bear."""
    began = time.perf_counter()
    folder = RunFolder(runs_dir / run / NAME)
    config = load_run_config(folder.config)
    wanted, grasps = config.agreement, read_columns(folder.artifact("grasps"))
    rng = generator(config.seed, NAME)
    names, objects = np.unique(grasps.object_name, return_inverse=True)
    chosen = judging.chosen_evenly(grasps.quality, objects, wanted.grasps, rng)  # scene by scene
    again = judging.chosen_evenly(grasps.quality[chosen], objects[chosen], wanted.varied, rng)
    among = np.isin(np.arange(len(chosen)), again)
    weights, poses = judging.stands_for(grasps.quality, chosen), grasps.world_from_gripper
    jobs = [
        SceneJob(int(scene), poses[rows], grasps.body_id[rows], some, folder, config)
        for scene in np.unique(grasps.scene[chosen])
        for here in [grasps.scene[chosen] == scene]
        for rows, some in [(chosen[here], among[here])]
    ]
    done = run_in_order(judge_scene, jobs, workers)
    parts = list(progress(done, len(jobs), "referee: judged", "scene"))
    found, among_n = (
        {name: np.concatenate([part[side][name] for part in parts]) for name in parts[0][side]}
        for side in (0, 1)
    )
    scores = {"q": grasps.quality[chosen], "p of Eq. (2)": grasps.pressure[chosen]}
    scores["label on the measured cloud"] = analytic(grasps, chosen, config)
    scores |= predicted(RunFolder(runs_dir / run), grasps, chosen, config)
    of_them = {name: score[among] for name, score in scores.items()}
    figures = {
        **figures_of(scores, found, objects[chosen], weights, wanted, rng),
        "varied": varied(of_them, found["borne_n"][among], among_n, wanted),
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


def predicted(run: RunFolder, grasps: GraspColumns, rows: np.ndarray, config: RunConfig) -> Columns:
    """The run's network, and that on objects it was not trained on; else the released one."""
    cloud, mask = grasps.cloud[rows], grasps.cloud_mask[rows]
    if not run.artifact("train").is_file():
        released = quality_source(RELEASED, config.gripper, SCORE_THREADS)
        return {"q-hat, released network": released.predict(cloud, mask)}
    score = control_predictor(run.artifact("train")).predict(cloud, mask)
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
    columns = {**vars(judging.judged(referee, radius_m, scene, job.pose, bodies))}
    columns["seconds"] = (time.process_time() - began) / len(bodies) + np.zeros(len(bodies))
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
        items = [objects[placed.object_name][0] for placed in there]
        poses = [placed.world_from_object for placed in there]
        scores = {n: float(c[number]) for n, c in columns.items() if c.dtype.kind == "f"}
        borne_n = scores["borne_n"]
        shown.append(shown_seal(items, poses, int(bodies[0]), pose[0], seal, borne_n, scores))
    key = read_provenance(folder.artifact("grasps")).key
    with recording(OwnRecording(NAME, folder.recording(NAME), key), blueprint()) as stream:
        show_seals(stream, shown, pad.disc, pad.fan.vacuum_pa)


if __name__ == "__main__":
    run_command(app)
