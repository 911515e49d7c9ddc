"""`make docs`: the pages and the reference of every module as a site, runs/docs/index.html."""

from pathlib import Path
from typing import Annotated

import typer
from loguru import logger

from pipeline.execution import run_command
from pipeline.reporting.site import write_site
from stages.graph import RUNS_DIR

ROOT = Path(__file__).resolve().parents[1]


def docs(
    folder: Annotated[Path, typer.Option(help="folder of the site")] = RUNS_DIR / "docs",
) -> None:
    """Write the documentation as a site."""
    write_site(ROOT, folder)
    logger.info("docs: {}", folder / "index.html")


if __name__ == "__main__":
    run_command(docs)
