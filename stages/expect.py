"""`make expect`: what must hold of a run's artifacts, and whether it does."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from pipeline.asking.cache import QUERY_CACHE
from pipeline.asking.expectations import as_markdown, check_expectations
from pipeline.config import load_run_config
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, run_command
from pipeline.execution.commands import EXIT_FAILURE
from stages.graph import RUNS_DIR, STAGES


def expect(
    run: Annotated[str, typer.Option(envvar="RUN", help="name of the run")] = "default",
    runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = RUNS_DIR,
) -> None:
    """Check every expectation of the stages that are there; non-zero where an error is found."""
    folder = RunFolder(runs_dir / run)
    made = {name: folder.artifact(name) for name in STAGES if folder.artifact(name).is_file()}
    if not made:
        raise ArtifactError(f"{folder.path} holds no artifact", f"make dataset RUN={run}")
    own = load_run_config(folder.config).expect
    found = [
        one
        for stage in made
        for one in check_expectations(stage, own, made, folder.state(QUERY_CACHE))
    ]
    sys.stdout.write(as_markdown(found))
    errors = sum(one.is_error for one in found)
    warnings = sum(bool(one.problem) for one in found) - errors
    sys.stdout.write(f"{len(found)} checked: {errors} errors, {warnings} warnings\n")
    if errors:
        raise typer.Exit(EXIT_FAILURE)


if __name__ == "__main__":
    run_command(expect)
