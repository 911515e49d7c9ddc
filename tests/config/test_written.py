"""A configuration written and read again is the same."""

from pathlib import Path

from pipeline.config import RunConfig, load_run_config
from pipeline.config.written import as_toml
from tests.docs.pages import ROOT


def test_every_run_of_the_repository_is_read_again_as_it_was(tmp_path: Path) -> None:
    path = tmp_path / "run.toml"
    runs = [load_run_config(p) for p in sorted((ROOT / "runs").glob("*/run.toml"))]
    for config in (RunConfig(), *runs):
        path.write_text(as_toml(config))
        assert load_run_config(path) == config
