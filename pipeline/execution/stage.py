"""A stage as data, the folder of its run, and the context that it runs in."""

import math
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from pipeline.artifacts import Input, Provenance, package_version
from pipeline.config import RunConfig
from pipeline.execution.executors import Executor
from pipeline.execution.freshness import Key
from pipeline.execution.run_folder import RunFolder as RunFolder
from pipeline.execution.run_store import RunStore
from pipeline.stopwatch import Stopwatch


@dataclass(frozen=True)
class Stage:
    """One stage of the pipeline, as data.

    Attributes
    ----------
    name
        Name of its module in stages/, its artifact and its recording.
    sections
        Configuration sections its artifact depends on.
    upstream
        Stages whose artifacts it reads.
    sharded
        Whether its artifact is an index over files in a folder of the same name.
    renders
        Whether its pictures come from the renderer that ``cameras.renderer`` names.
    shown
        Configuration that says how much its recording shows.
    drawn_apart
        Whether its recording is drawn from its finished artifact, by `drawing_module`, so that a
        change of drawing code makes the recording anew and leaves the artifact.
    """

    name: str
    sections: tuple[str, ...]
    upstream: tuple[str, ...] = ()
    sharded: bool = False
    renders: bool = False
    shown: tuple[str, ...] = ()
    drawn_apart: bool = False

    @property
    def module(self) -> str:
        """The Python module that runs it."""
        return f"stages.{self.name}"

    @property
    def drawing_module(self) -> str:
        """The Python module that draws its recording from its artifact."""
        return f"pipeline.recording.{self.name}"


@dataclass(frozen=True)
class StageContext:
    """What a running stage is given.

    Attributes
    ----------
    stage
        The stage.
    config
        The run's configuration.
    folder
        Paths of the run.
    key
        What the artifact depends on.
    drawing_key
        What the recording depends on.
    inputs
        Name → file of everything the stage reads.
    workers
        Processes to work in.
    mesh_dir
        Folder of meshes; None: the embedded objects.
    executor
        Whether work runs in local processes or on a Ray cluster.
    store
        The object store in which the run lies; None: it lies in its folder.
    item_limit_s
        How long a work item may take in a worker before it is said to hang [s].
    drawing
        Processor time that the recording costs.
    checking
        Processor time that checking what is expected costs, wherever it is spent.
    expectations
        What was expected of the finished artifact and what was found, Markdown; empty where nothing
        was checked.
    """

    stage: Stage
    config: RunConfig
    folder: RunFolder
    key: Key
    drawing_key: Key
    inputs: dict[str, Path]
    workers: int
    mesh_dir: Path | None
    executor: Executor = "local"
    store: RunStore | None = None
    item_limit_s: float = math.inf
    drawing: Stopwatch = field(default_factory=Stopwatch)
    checking: Stopwatch = field(default_factory=Stopwatch)
    expectations: str = ""

    @property
    def name(self) -> str:
        """The stage's name."""
        return self.stage.name

    @property
    def has_workers(self) -> bool:
        """Whether work items run in other processes than this one."""
        return self.executor != "local" or self.workers > 1

    @property
    def works_from_store(self) -> bool:
        """Whether work items run on nodes that take files from the run's store."""
        return self.store is not None and self.executor != "local"

    def lending(self, folder: Path | None, files: Sequence[Path]) -> AbstractContextManager[None]:
        """Nodes that take files from the store have these files of a folder outside the run."""
        if folder is None or self.store is None or not self.works_from_store:
            return nullcontext()
        return self.store.lending(folder, files)

    @property
    def recording_id(self) -> str:
        """Equal for equal results, so that equal runs open as the same recording."""
        return self.key.digest

    @property
    def output(self) -> Path:
        """The artifact this stage makes."""
        return self.folder.artifact(self.stage.name)

    @property
    def recording(self) -> Path:
        """The recording this stage makes."""
        return self.folder.recording(self.stage.name)

    @property
    def shards(self) -> Path:
        """The folder of this stage's shards."""
        return self.folder.shards(self.stage.name)

    def upstream(self, stage: str) -> Path:
        """The artifact of a stage this one reads."""
        return self.inputs[f"{stage}.mcap"]

    def provenance(self, cut_short: Sequence[str] = ()) -> Provenance:
        """The record every file of this stage carries.

        Parameters
        ----------
        cut_short
            Inputs that were left out for want of time or memory; with any, the file is never fresh.

        Returns
        -------
        The record.
        """
        key = self.key.cut_short(cut_short)
        return Provenance(
            stage=self.stage.name,
            key=key.digest,
            config_digest=key.config_digest,
            code_digest=key.code_digest,
            seed=self.config.seed,
            inputs=tuple(Input(name, digest) for name, digest in key.inputs.items()),
            package_version=package_version(),
            key_parts=key.to_json(),
        )
