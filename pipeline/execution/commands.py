"""Commands beside the stages: words on the screen, and a failure that ends in one sentence."""

import sys
from collections.abc import Callable
from typing import TextIO

import typer
from loguru import logger

from pipeline.errors import SoftgripError

EXIT_FAILURE = 1  # what shells read as a failure


def run_command(command: Callable[..., None] | typer.Typer) -> None:
    """Run a function, or an app of several, from the command line; its options are typer's."""
    words_to(sys.stderr)
    app = command
    if not isinstance(app, typer.Typer):
        app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
        app.command()(command)
    try:
        app()
    except SoftgripError as error:
        logger.error("{}", error)
        sys.exit(EXIT_FAILURE)


def words_to(sink: TextIO, level: str = "INFO") -> None:
    """What is told goes to ``sink``, a line each, with neither date nor place in the code."""
    logger.remove()
    logger.add(sink, level=level, format="{message}")
