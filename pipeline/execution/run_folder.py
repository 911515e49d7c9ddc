"""Where the files of a run lie."""

from dataclasses import dataclass
from pathlib import Path

from pipeline.artifacts.named_inputs import noted_mesh_dir


@dataclass(frozen=True)
class RunFolder:
    """Paths of all files of one run."""

    path: Path

    def artifact(self, stage: str) -> Path:
        """The MCAP a stage hands over (for a sharded stage: its index)."""
        return self.path / f"{stage}.mcap"

    def shards(self, stage: str) -> Path:
        """The folder of a sharded stage's files."""
        return self.path / stage

    def recording(self, stage: str) -> Path:
        """The Rerun recording of a stage."""
        return self.path / f"{stage}.rrd"

    def summary(self, stage: str) -> Path:
        """The headline figures of a stage."""
        return self.path / f"{stage}.summary.json"

    def layout(self, stage: str) -> Path:
        """The layout by which Foxglove shows a stage's artifact."""
        return self.path / f"{stage}.foxglove.json"

    def log(self, stage: str) -> Path:
        """The log of a stage's last runs, traces included."""
        return self.path / "logs" / f"{stage}.log"

    def state(self, name: str) -> Path:
        """Bookkeeping that is not a result: keys, hashes, resume points."""
        return self.path / ".state" / name

    @property
    def noted_mesh_dir(self) -> Path | None:
        """The mesh folder that Make noted in the run; None for the embedded objects."""
        return noted_mesh_dir(self.path)

    @property
    def cache(self) -> Path:
        """Folder that all runs share, a run within a run too; all in it can be made again."""
        within = (self.path.parent / "run.toml").is_file()
        return (self.path.parent.parent if within else self.path.parent) / ".cache"

    @property
    def config(self) -> Path:
        """The run's configuration."""
        return self.path / "run.toml"
