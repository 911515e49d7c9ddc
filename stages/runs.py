"""Many runs: `make list`, `make prune`, `make seal` and `make unseal`."""

import sys
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.config import load_run_config
from pipeline.errors import ArtifactError, SoftgripError
from pipeline.execution.commands import EXIT_FAILURE, run_command
from pipeline.execution.run_store import opened, store_named_in
from pipeline.execution.sealing import broken_files, is_sealed, read_seal, refuse_sealed
from pipeline.execution.sealing import seal as seal_run
from pipeline.execution.sealing import unseal as unseal_run
from pipeline.execution.stage import RunFolder
from pipeline.housekeeping.listing import (
    SUCCESS,
    TEST_ERROR,
    RunFacts,
    as_table,
    facts_of,
    run_folders,
    size_in_words,
)
from pipeline.housekeeping.pruning import free, freeable, in_use
from stages.freshness import reasons
from stages.graph import MADE, RUNS_DIR, STAGES

COUNTS = ("objects", "scenes", "grasps")
HEAD = ["run", "disk", "stages", *COUNTS, TEST_ERROR, SUCCESS, "state", "made from"]
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RunsDir = Annotated[Path, typer.Option(help="folder of all runs")]
RunName = Annotated[str, typer.Option(envvar="RUN", help="name of the run")]


@app.command("list")
def list_runs(runs_dir: RunsDir = RUNS_DIR) -> None:
    """Print every run: disk, stages, headline figures, whether it is stale, what it came from."""
    rows = [
        row_of(facts_of(folder, runs_dir, tuple(STAGES)), state_of(folder))
        for folder in run_folders(runs_dir)
    ]
    sys.stdout.write(as_table([HEAD, *rows]))


def row_of(facts: RunFacts, state: str) -> list[str]:
    """One line of the list."""
    figures = facts.headline
    counts = [f"{figures[name]:.0f}" if name in figures else "" for name in COUNTS]
    error = f"{figures[TEST_ERROR]:.4f}" if TEST_ERROR in figures else ""
    success = f"{figures[SUCCESS]:.0%}" if SUCCESS in figures else ""
    stages = " ".join(facts.made) or "none"
    size = size_in_words(facts.size_bytes)
    return [facts.name, size, stages, *counts, error, success, state, facts.made_from]


def state_of(folder: RunFolder) -> str:
    """Whether what a run holds is sealed, up to date, stale from which stage on, or unreadable."""
    if is_sealed(folder):
        return "sealed"
    made = [name for name in STAGES if folder.artifact(name).is_file()]
    if not made:
        return ""
    try:
        load_run_config(folder.config)
        stale = [name for name, why in reasons(folder, folder.noted_mesh_dir, made).items() if why]
    except SoftgripError as error:
        return f"cannot be made anew: {error.what}"
    return f"stale from {stale[0]} on" if stale else "up to date"


@app.command()
def prune(
    run: Annotated[str, typer.Option(help="one run alone; else all")] = "",
    free_now: Annotated[bool, typer.Option("--free", help="delete it")] = False,
    runs_dir: RunsDir = RUNS_DIR,
) -> None:
    """Show what can be made again, and with --free delete it."""
    folders = [RunFolder(runs_dir / run)] if run else list(run_folders(runs_dir))
    total = 0
    rows = [["folder", "disk", "made again by"]]
    for folder in folders:
        if not folder.path.is_dir():
            raise ArtifactError(f"{folder.path} is missing", "'make list' shows the runs")
        if in_use(folder):
            logger.warning("{} is left alone: a process works in it", folder.path)
            continue
        found = free(folder, tuple(MADE)) if free_now else freeable(folder, tuple(MADE))
        total += sum(item.size_bytes for item in found)
        rows += [[str(i.path), size_in_words(i.size_bytes), i.again_by] for i in found]
    if total:
        sys.stdout.write(as_table(rows))
    verb = "freed" if free_now else "can be freed: make prune FREE=1"
    sys.stdout.write(f"{size_in_words(total)} {verb}\n")


@app.command()
def seal(run: RunName = "default", runs_dir: RunsDir = RUNS_DIR) -> None:
    """Record every file of a run; nothing in it is made anew from then on."""
    folder = RunFolder(runs_dir / run)
    refuse_sealed(folder)
    with opened(folder, store_named_in(folder), "seal") as store:
        refuse_sealed(folder)  # its seal may have come from the store
        logger.info("{} is sealed: {} files", folder.path, len(seal_run(folder).files))
        if store is not None:
            store.put()


@app.command()
def unseal(run: RunName = "default", runs_dir: RunsDir = RUNS_DIR) -> None:
    """Take a run's seal off: what is stale is made anew again."""
    folder = RunFolder(runs_dir / run)
    with opened(folder, store_named_in(folder), "unseal") as store:
        unseal_run(folder)
        if store is not None:
            store.put()
    logger.info("{} is no longer sealed", runs_dir / run)


@app.command()
def check(run: RunName = "default", runs_dir: RunsDir = RUNS_DIR) -> None:
    """Compare a sealed run with its seal; non-zero where a file differs."""
    folder = RunFolder(runs_dir / run)
    broken = broken_files(folder)
    for sentence in broken:
        sys.stdout.write(sentence + "\n")
    sys.stdout.write(f"{len(read_seal(folder).files) - len(broken)} files as sealed\n")
    if broken:
        raise typer.Exit(EXIT_FAILURE)


if __name__ == "__main__":
    run_command(app)
