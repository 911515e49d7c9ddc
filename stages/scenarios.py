"""`make scenarios`: the failure modes of Supplement VIII, one attempt a scene, by policy.

Reads a run's configuration and its trained network; writes scenarios.md and scenarios.json
beside them. Attempts are judged as in stage evaluate.
"""

import json
import os
import sys
from collections import Counter
from dataclasses import dataclass
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
from pipeline.simulation.picking import Clutter
from pipeline.simulation.scenarios import SCENARIOS, make_trials, with_segmentation
from stages.evaluate import network
from stages.graph import RUNS_DIR

TRIALS = 10  # scenes a scenario; tables say «of 10»


@dataclass(frozen=True)
class ScenarioJob:
    """One work item: one policy on all trials of one scenario."""

    index: int
    policy: PolicyName
    checkpoint: Path
    config: RunConfig
    trials: int


@dataclass(frozen=True)
class Row:
    """Result of one policy in one scenario."""

    scenario: str
    policy: str
    lifted: int
    tried: int
    failures: dict[str, int]


def scenarios(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    workers: Annotated[int, typer.Option(envvar="WORKERS", min=1)] = len(os.sched_getaffinity(0)),
) -> None:
    """Every scenario under every policy of the run."""
    folder = RunFolder(RUNS_DIR / run)
    config = load_run_config(folder.config)
    jobs = [
        ScenarioJob(index, policy, folder.artifact("train"), config, TRIALS)
        for index in range(len(SCENARIOS))
        for policy in config.evaluate.policies
    ]
    done = run_in_order(run_scenario, jobs, workers)
    rows = list(progress(done, len(jobs), "scenarios", "row"))
    text = table(rows)
    publish_bytes(folder.path / "scenarios.md", text.encode())
    figures = [row.__dict__ for row in rows]
    publish_bytes(folder.path / "scenarios.json", (json.dumps(figures, indent=1) + "\n").encode())
    sys.stdout.write(text)


def run_scenario(job: ScenarioJob) -> Row:
    """Make one attempt in each trial of a scenario."""
    scenario = SCENARIOS[job.index]
    config = with_segmentation(job.config, scenario)
    strategy = build_strategy(job.policy, network(job.checkpoint).predict, config)
    # The same scenes for every policy, and for the same things seen otherwise.
    rng = generator(config.seed, "scenario", scenario.name.removesuffix(", segmented"))
    scenes = make_trials(scenario, job.trials, job.config.objects.density_kg_m3, rng)
    causes: Counter[str] = Counter()
    for scene, objects in scenes:
        rng = generator(config.seed, "attempt", scene.scene_id)
        clutter = Clutter(scene, objects, config, rng)
        clutter.gripper.conveyor_m_s = scenario.speed_m_s
        causes[str(clutter.make_attempt(strategy, []).cause)] += 1
    lifted = causes.pop(str(Cause.LIFTED), 0)
    return Row(scenario.name, job.policy, lifted, job.trials, dict(sorted(causes.items())))


def table(rows: list[Row]) -> str:
    """The results as a Markdown table."""
    lines = []
    for row in rows:
        rate, low, high = success_rate(row.lifted, row.tried)
        failures = ", ".join(f"{cause} {n}" for cause, n in row.failures.items()) or "none"
        lines.append(
            f"| {row.scenario} | {row.policy} | {row.lifted} / {row.tried} "
            f"| {100 * rate:.0f} % ({100 * low:.0f}-{100 * high:.0f}) | {failures} |"
        )
    return (
        "| scenario | policy | lifted | success (95 % interval) | failures |\n|-|-|-|-|-|\n"
        + "\n".join(lines)
        + "\n"
    )


if __name__ == "__main__":
    run_command(scenarios)
