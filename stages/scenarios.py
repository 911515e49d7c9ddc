"""`make scenarios`: the failure modes of Supplement VIII, one attempt a scene, by policy.

Each is tried twice: judged by the label on a perfect robot, without transport, as these tables were
first made; and as the run says: by its judge, with its robot's errors and its transport. Reads a
run's configuration and its network, or the one that NETWORK names; writes scenarios.md and
scenarios.json beside them.
"""

import json
import os
import sys
from collections import Counter
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated

import typer

from pipeline.artifacts import publish_bytes
from pipeline.config import RunConfig, load_run_config
from pipeline.config.evaluation import PolicyName
from pipeline.control.decision import Cause
from pipeline.control.strategies import build_strategy
from pipeline.control.success import success_rate
from pipeline.execution import RunFolder, generator, progress, run_command, run_in_order
from pipeline.messages.trained import rates_for
from pipeline.network.given import given_network
from pipeline.network.sources import RELEASED
from pipeline.simulation.imperfection import with_imperfection
from pipeline.simulation.picking import Clutter
from pipeline.simulation.scenarios import SCENARIOS, make_trials, with_segmentation
from stages.graph import GIVEN_NETWORK, RUNS_DIR

FOLDER = "scenarios"  # where a network that is named is kept
BEFORE, AFTER = "label, perfect robot", "as configured"


@dataclass(frozen=True)
class ScenarioJob:
    """One work item: one policy on all trials of one scenario, under one of the conditions."""

    index: int
    policy: PolicyName
    condition: str
    network: Path
    config: RunConfig
    trials: int


@dataclass(frozen=True)
class Row:
    """Result of one policy in one scenario under one of the conditions."""

    scenario: str
    policy: str
    condition: str
    lifted: int
    tried: int
    failures: dict[str, int]


def scenarios(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    workers: Annotated[int, typer.Option(envvar="WORKERS", min=1)] = len(os.sched_getaffinity(0)),
    named: Annotated[
        str,
        typer.Option(
            "--network", envvar="NETWORK", help=f"'{RELEASED}', or a file; else the run's own"
        ),
    ] = "",
    trials: Annotated[
        int, typer.Option(envvar="TRIALS", min=1, help="scenes of each scenario")
    ] = 10,
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Every scenario under every policy of the run, before and after."""
    folder = RunFolder(runs_dir / run)
    config = load_run_config(folder.config)
    path = folder.artifact("train")
    if named:
        path = folder.path / FOLDER / GIVEN_NETWORK
        publish_bytes(path, given_network(named, config.sensing.grid_cells).exported)
    conditions = {BEFORE: as_before(config), AFTER: config}
    jobs = [
        ScenarioJob(index, policy, condition, path, conditions[condition], trials)
        for index in range(len(SCENARIOS))
        for policy in config.evaluate.policies
        for condition in conditions
    ]
    done = run_in_order(run_scenario, jobs, workers)
    rows = list(progress(done, len(jobs), "scenarios", "row"))
    text = table(rows, config)
    publish_bytes(folder.path / "scenarios.md", text.encode())
    figures = [asdict(row) for row in rows]
    publish_bytes(folder.path / "scenarios.json", (json.dumps(figures, indent=1) + "\n").encode())
    sys.stdout.write(text)


def as_before(config: RunConfig) -> RunConfig:
    """Judged by the label, on a perfect robot, and not transported."""
    perfect = with_imperfection(config, 0.0).evaluate
    transport = perfect.transport.model_copy(update={"accelerations_m_s2": ()})
    evaluate = perfect.model_copy(update={"judge": "label", "transport": transport})
    return config.model_copy(update={"evaluate": evaluate})


def run_scenario(job: ScenarioJob) -> Row:
    """Make one attempt in each trial of a scenario."""
    scenario = SCENARIOS[job.index]
    config = with_segmentation(job.config, scenario)
    score = rates_for(job.policy, job.network, config)
    strategy = build_strategy(job.policy, score, config)
    # The same scenes for every policy and condition, and for the same things seen otherwise.
    rng = generator(config.seed, "scenario", scenario.name.removesuffix(", segmented"))
    scenes = make_trials(scenario, job.trials, job.config.objects.density_kg_m3, rng)
    causes: Counter[str] = Counter()
    for scene, objects in scenes:
        rng = generator(config.seed, "attempt", scene.scene_id)
        clutter = Clutter(scene, objects, config, rng)
        clutter.gripper.conveyor_m_s = scenario.speed_m_s
        causes[str(clutter.make_attempt(strategy, []).cause)] += 1
    lifted = causes.pop(str(Cause.LIFTED), 0)
    failures = dict(sorted(causes.items()))
    return Row(scenario.name, job.policy, job.condition, lifted, job.trials, failures)


def table(rows: list[Row], config: RunConfig) -> str:
    """The results as a Markdown table, the two conditions beside each other."""
    found = {(row.scenario, row.policy, row.condition): row for row in rows}
    robot, carried = config.evaluate.imperfection, config.evaluate.transport.accelerations_m_s2
    now = f"{config.evaluate.judge}, errors times {robot.scale:g}"
    if carried:
        now += f", carried at up to {max(carried):g} m/s²"
    lines = [
        f"| scenario | policy | lifted: {BEFORE} | failures | lifted: {now} | failures |",
        "|-|-|-|-|-|-|",
    ]
    lines += [
        f"| {scenario} | {policy} | "
        + " | ".join(_cells(found[scenario, policy, each]) for each in (BEFORE, AFTER))
        + " |"
        for scenario, policy in dict.fromkeys((row.scenario, row.policy) for row in rows)
    ]
    return "\n".join(lines) + "\n"


def _cells(row: Row) -> str:
    _, low, high = success_rate(row.lifted, row.tried)
    failures = ", ".join(f"{cause} {n}" for cause, n in row.failures.items()) or "none"
    return f"{row.lifted} / {row.tried} ({100 * low:.0f}-{100 * high:.0f} %) | {failures}"


if __name__ == "__main__":
    run_command(scenarios)
