"""Ask a run in SQL: `make query RUN=... SQL="..."`; the tables are told by schemas/TABLES.md."""

import sys
import time
from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.asking.answers import as_text, write_answer
from pipeline.asking.cache import QUERY_CACHE
from pipeline.asking.query import ask
from pipeline.errors import ArtifactError
from pipeline.execution.commands import run_command
from pipeline.execution.stage import RunFolder
from pipeline.housekeeping.pruning import in_use
from schemas.tables import OF_STAGES, TABLES
from stages.graph import RUNS_DIR

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
Sql = Annotated[str, typer.Argument(envvar="SQL", help="a question; none: the tables there are")]
RunName = Annotated[str, typer.Option(envvar="RUN", help="name of the run")]
RunsDir = Annotated[Path, typer.Option(help="folder of all runs")]
Out = Annotated[Path | None, typer.Option(help="write all rows to this .csv or .parquet")]
Show = Annotated[bool, typer.Option(help="record the grasps, or attempts, of the answer")]


@app.command()
def query(
    sql: Sql = "",
    run: RunName = "default",
    runs_dir: RunsDir = RUNS_DIR,
    out: Out = None,
    show: Show = False,
) -> None:
    """Answer a question about a run as a table, a file, or a recording."""
    folder = RunFolder(runs_dir / run)
    made = artifacts_of(folder)
    if not made:
        raise ArtifactError(f"{folder.path} holds nothing to ask", f"make dataset RUN={run}")
    if not sql.strip():
        sys.stdout.write(tables_there_are(made))
        return
    if in_use(folder):
        logger.warning("{} is being worked in: this is its last whole state", folder.path)
    started = time.perf_counter()
    answer = ask(sql, made, folder.state(QUERY_CACHE))
    logger.info("answered in {:.2f} s", time.perf_counter() - started)
    if show:
        # Recordings and their messages take seconds to load, and few answers are shown.
        from pipeline.asking.showing import show_answer
        from pipeline.config import load_run_config

        config = load_run_config(folder.config)
        recording = show_answer(answer, made, config, folder.path / "query.rrd")
        logger.info("{}: open it by .venv/bin/rerun {}", recording, recording)
    if out:
        write_answer(answer, out)
        logger.info("{} rows are in {}", answer.num_rows, out)
    else:
        sys.stdout.write(as_text(answer))


def artifacts_of(folder: RunFolder) -> dict[str, Path]:
    """Stage → its artifact, of those that are there and hold tables."""
    paths = {table.stage: folder.artifact(table.stage) for table in OF_STAGES}
    return {stage: path for stage, path in paths.items() if path.is_file()}


def tables_there_are(made: dict[str, Path]) -> str:
    """Every table with its columns, and the stage that makes those that are not there."""
    lines = []
    for table in TABLES:
        columns = ", ".join(column.name for column in table.columns)
        there = "" if table.stage in {"", *made} else f" (not made yet: stage {table.stage})"
        lines.append(f"{table.name}{there}: {columns}\n")
    return "".join(lines)


if __name__ == "__main__":
    run_command(app)
