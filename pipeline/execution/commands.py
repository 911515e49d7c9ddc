"""Commands that are not stages: where messages go, and failures that end in one sentence."""

import sys
from collections.abc import Callable
from typing import TextIO

import typer
from loguru import logger

from pipeline.errors import SoftgripError

EXIT_FAILURE = 1  # what shells read as a failure


def run_command(command: Callable[..., None] | typer.Typer) -> None:
    """Run a function, or a typer app of several, as a command line; exit non-zero on failure."""
    log_to(sys.stderr)
    app = command
    if not isinstance(app, typer.Typer):
        app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        app.command()(command)
    try:
        app()
    except SoftgripError as error:
        logger.error("{}", error)
        sys.exit(EXIT_FAILURE)


def log_to(sink: TextIO, level: str = "INFO") -> None:
    """Send log messages to ``sink``, one a line, without date or place in the code."""
    logger.remove()
    logger.add(sink, level=level, format="{message}")
