"""Running one stage from the command line: lock, freshness, log, summary, readable failures."""

import gc
import json
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Annotated, Any

import typer
from filelock import FileLock, Timeout
from loguru import logger

from pipeline.artifacts import open_artifact, publish_bytes, read_provenance
from pipeline.artifacts.digests import MEMO
from pipeline.artifacts.publishing import CANNOT_WRITE, remove_abandoned_scratch, write_error
from pipeline.artifacts.sharding import listed_shards
from pipeline.config import load_run_config
from pipeline.errors import SoftgripError
from pipeline.execution.commands import EXIT_FAILURE, log_to
from pipeline.execution.executors import Executor
from pipeline.execution.run_store import fetch_configuration, opened
from pipeline.execution.sealing import is_sealed, refuse_sealed
from pipeline.execution.stage import RunFolder, Stage, StageContext
from pipeline.execution.staleness import (
    InputsOf,
    artifact_is_fresh,
    drawing_note_path,
    is_fresh,
    stage_context,
)
from pipeline.stopwatch import Stopwatch, processor_time_s

Summary = dict[str, Any]
Build = Callable[[StageContext], Summary]
Draw = Callable[[StageContext, Summary], None]

CLOCK_TICK_S = 0.01  # what processor time is counted in

EXIT_INTERRUPTED = 130  # what shells read as ended by SIGINT


def stage_command(
    stage: Stage, build: Build, inputs_of: InputsOf, rank: int = 0, draw: Draw | None = None
) -> None:
    """The command line of a stage's module.

    Parameters
    ----------
    stage
        What it is.
    build
        Makes the artifact, and returns the headline figures.
    inputs_of
        Name → file of everything a stage reads.
    rank
        This process's number among several that build together; the first alone holds the run,
        tells and publishes.
    draw
        Draws the recording from the finished artifact and the headline figures; without it
        ``build`` draws.
    """

    def command(
        run: Annotated[str, typer.Option(help="name of the run: runs/<run>/run.toml")] = "default",
        runs_dir: Annotated[Path, typer.Option(help="folder of all runs")] = Path("runs"),
        mesh_dir: Annotated[
            Path | None,
            typer.Option(envvar="MESH_DIR", help="folder of meshes; without it the embedded set"),
        ] = None,
        workers: Annotated[
            int, typer.Option(envvar="WORKERS", min=1, help="worker processes")
        ] = len(os.sched_getaffinity(0)),
        executor: Annotated[
            Executor, typer.Option(envvar="EXECUTOR", help="local processes, or a Ray cluster")
        ] = "local",
        item_limit_s: Annotated[
            float,
            typer.Option(envvar="ITEM_LIMIT_S", min=1, help="a worker that takes longer hangs [s]"),
        ] = 3600.0,
        force: Annotated[bool, typer.Option(help="run even when nothing changed")] = False,
    ) -> None:
        # What is imported stays: to look for garbage in it takes 0.2 s, several times a stage.
        gc.freeze()
        folder = RunFolder(runs_dir / run)
        with _readable_failures(stage, folder, rank):
            if is_sealed(folder) and folder.artifact(stage.name).is_file() and not force:
                # Make calls the stages of a run that came without its bookkeeping.
                logger.info("{}: {} is sealed, and stays as it is", stage.name, folder.path)
                return
            # Of its own for each process: two would write one memo at once.
            memo = f"hashes.rank{rank}.json" if rank else MEMO

            def context_now() -> StageContext:
                context = stage_context(stage, folder, inputs_of, mesh_dir, workers, memo)
                return replace(context, executor=executor, item_limit_s=item_limit_s)

            if rank > 0:
                context = context_now()
                if force or not artifact_is_fresh(context):
                    build(context)
                return
            fetch_configuration(folder)
            kept_in = load_run_config(folder.config).store
            refuse_sealed(folder)
            with _exclusive(folder, stage), opened(folder, kept_in, stage.name) as store:
                refuse_sealed(folder)  # its seal may have come from the store
                run_stage(replace(context_now(), store=store), build, force, draw)
                if store is not None and (put := store.put()):
                    logger.info("{}: {} files are in {}", stage.name, put, store.place.url)

    command.__doc__ = build.__doc__
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command(name=stage.name)(command)
    app()


def run_stage(
    context: StageContext, build: Build, force: bool = False, draw: Draw | None = None
) -> None:
    """Run a stage unless it is fresh; leave artifact, recording, summary and layout.

    Where the recording alone is stale, it is drawn anew and the artifact stays as it is.
    """
    name = context.stage.name
    if not force and is_fresh(context):
        _renew_date(context)
        logger.info("{}: up to date, nothing to do", name)
        return
    started = time.perf_counter()
    if draw is not None and not force and artifact_is_fresh(context):
        logger.info("{}: the artifact is up to date, its recording is drawn anew", name)
        record = read_summary(context.folder, name)
        context, _ = checked(context)
        draw_recording(context, draw, record)
        _publish_summary(context, record | _recording_size(context))
        _renew_date(context)
        logger.info("{}: drawn in {:.1f} s", name, time.perf_counter() - started)
        return
    logger.info("{}: started ({} workers)", name, context.workers)
    figures = build(context)
    with context.checking.running(whole_process=True):
        context, found = checked(context)
    if draw is not None:
        draw_recording(context, draw, figures)
    # Of the whole process: what Python loads counts in the parts, and so it counts in the whole.
    wall_s, spent_s = time.perf_counter() - started, processor_time_s()
    record = {
        "stage": name,
        "key": read_provenance(context.output).key,
        "wall_time_s": round(wall_s, 3),
        "recording_share": share_of(context.drawing, spent_s),
        **_recording_size(context),
        "expectations": found,
        "expectations_s": round(context.checking.seconds, 3),
        "expectations_share": share_of(context.checking, spent_s),
        **figures,
    }
    _publish_summary(context, record)
    _publish_layout(context)
    logger.info("{}: done in {:.1f} s, {}", name, wall_s, context.output)


def _renew_date(context: StageContext) -> None:
    """Make compares dates: what is fresh by content is new by date."""
    store = context.store
    with store.same(context.output) if store is not None else nullcontext():
        os.utime(context.output)


def share_of(part: Stopwatch, spent_s: float) -> float:
    """A part's share of a stage's processor time [1]; what Python loads is counted in both."""
    return round(part.seconds / max(spent_s, CLOCK_TICK_S), 4)


def draw_recording(context: StageContext, draw: Draw, figures: Summary) -> None:
    """Draw the recording, and record the key that it was drawn with."""
    draw(context, figures)
    note = context.drawing_key.to_json().encode()
    publish_bytes(drawing_note_path(context.folder, context.name), note)


def checked(context: StageContext) -> tuple[StageContext, list[dict[str, Any]]]:
    """Check what is expected at the end of the stage, and tell what does not hold."""
    # DuckDB is loaded where a stage has ended, not wherever a key is computed.
    from pipeline.asking.cache import QUERY_CACHE
    from pipeline.asking.expectations import as_markdown, check_expectations
    from schemas.tables import OF_STAGES

    stages = sorted({table.stage for table in OF_STAGES})
    made = {name: context.folder.artifact(name) for name in stages}
    found = check_expectations(
        context.name,
        context.config.expect,
        {name: path for name, path in made.items() if path.is_file()},
        context.folder.state(QUERY_CACHE),
    )
    for one in found:
        if one.problem:
            tell = logger.error if one.is_error else logger.warning
            tell(
                "{}: {}: {}. {}", context.name, one.expected.name, one.problem, one.expected.reason
            )
    text = as_markdown(found) if found else ""
    return replace(context, expectations=text), [one.figures() for one in found]


def read_summary(folder: RunFolder, stage: str) -> Summary:
    """Read the summary of a finished stage; empty where the file is missing or damaged."""
    try:
        return dict(json.loads(folder.summary(stage).read_text()))
    except (FileNotFoundError, ValueError):
        return {}


def _recording_size(context: StageContext) -> Summary:
    return {"recording_mb": round(context.recording.stat().st_size / 1e6, 3)}


def _publish_layout(context: StageContext) -> None:
    # Foxglove's messages are loaded where a stage has ended, not wherever a key is computed.
    from pipeline.interchange.foxglove_layouts import foxglove_layout

    with open_artifact(context.output) as artifact:
        topics = artifact.counts()
    # What a person looks at lies in the files that an index names, where there is one.
    if context.stage.sharded and (shards := listed_shards(context.output)):
        with open_artifact(shards[0]) as artifact:
            topics |= artifact.counts()
    publish_bytes(context.folder.layout(context.name), foxglove_layout(topics))


def _publish_summary(context: StageContext, record: Summary) -> None:
    text = json.dumps(record, indent=2) + "\n"
    publish_bytes(context.folder.summary(context.name), text.encode())


@contextmanager
def _exclusive(folder: RunFolder, stage: Stage) -> Iterator[None]:
    """Let one process at a time work in a run; a second one fails with the name of the first."""
    owner = folder.state("owner")
    owner.parent.mkdir(parents=True, exist_ok=True)
    lock = FileLock(folder.state("lock"))
    try:
        lock.acquire(timeout=0)
    except Timeout as error:
        holder = owner.read_text().strip() if owner.is_file() else "another process"
        raise SoftgripError(
            f"{folder.path} is in use by {holder}",
            "Wait until it is done, or stop it, then run the same command again",
        ) from error
    try:
        owner.write_text(f"process {os.getpid()} (stage {stage.name})\n")
        for place in (folder.path, folder.cache):
            remove_abandoned_scratch(place)
        yield
    finally:
        remove_abandoned_scratch(folder.path)  # of workers that were killed
        owner.unlink(missing_ok=True)
        lock.release()


@contextmanager
def _readable_failures(stage: Stage, folder: RunFolder, rank: int) -> Iterator[None]:
    """Every failure ends in one sentence and a non-zero exit; the trace goes to the log."""
    log_to(sys.stderr, "ERROR" if rank else "INFO")
    signal.signal(signal.SIGTERM, _as_interrupt)
    log = folder.log(f"{stage.name}.rank{rank}" if rank else stage.name)
    try:
        if folder.path.is_dir():
            folder.state("").mkdir(parents=True, exist_ok=True)
            logger.add(log, level="DEBUG", diagnose=False, rotation="10 MB", retention=3)
        yield
    except SoftgripError as error:
        logger.error("{}: {}", stage.name, error)
        _trace(error)
        raise SystemExit(EXIT_FAILURE) from None
    except KeyboardInterrupt as error:
        logger.error(
            "{}: interrupted. What is finished is kept: run the same command to go on", stage.name
        )
        _trace(error)
        raise SystemExit(EXIT_INTERRUPTED) from None
    except Exception as error:  # noqa: BLE001 - the last line of defence, told and logged
        logger.error("{}: {}", stage.name, _failure_sentence(error, folder, log))
        _trace(error)
        raise SystemExit(EXIT_FAILURE) from None


def _failure_sentence(error: Exception, folder: RunFolder, log: Path) -> str:
    """The sentence for a failure that is no SoftgripError: the disk cannot be written, or a bug."""
    if isinstance(error, OSError) and error.errno in CANNOT_WRITE:
        return str(write_error(Path(error.filename or folder.path), error))
    return f"unexpected {type(error).__name__}: {error}. The trace is in {log}"


def _trace(error: BaseException) -> None:
    logger.opt(exception=error).debug("trace")


def _as_interrupt(signum: int, frame: FrameType | None) -> None:
    raise KeyboardInterrupt
