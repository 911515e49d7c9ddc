"""The object store in which a run lies: whether it can be used, and a run brought from it.

`make status` and `make doctor` print the first; `make pull` does the second.
"""

import sys
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.config import load_run_config
from pipeline.errors import ConfigError
from pipeline.execution.commands import run_command
from pipeline.execution.run_store import VARIABLE, fetch_configuration, look, opened
from pipeline.execution.stage import RunFolder
from stages.graph import RUNS_DIR

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
RunName = Annotated[str, typer.Option(envvar="RUN", help="name of the run")]
RunsDir = Annotated[Path, typer.Option(help="folder of all runs")]


@app.command("look")
def look_at_store(run: RunName = "default", runs_dir: RunsDir = RUNS_DIR) -> None:
    """Print the run's store and whether it can be written; nothing where it has none."""
    for line in look(RunFolder(runs_dir / run)):
        sys.stdout.write(line + "\n")


@app.command()
def pull(run: RunName = "default", runs_dir: RunsDir = RUNS_DIR) -> None:
    """Bring a run from its store to its folder here, as for a report or a training."""
    folder = RunFolder(runs_dir / run)
    fetch_configuration(folder)
    folder.state("").mkdir(parents=True, exist_ok=True)
    with opened(folder, load_run_config(folder.config).store, "pull") as store:
        if store is None:
            raise ConfigError(
                f"{folder.path} lies in its folder alone",
                f"Name its store in {folder.config} ([store] url), or by {VARIABLE}",
            )
        logger.info("{} has what {} has", folder.path, store.place.url)


if __name__ == "__main__":
    run_command(app)
