"""The report of a run: whole, self-contained, the same again, and honest about what is missing."""

import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from pipeline.artifacts import ArtifactWriter, open_artifact
from pipeline.config.agreement import AgreementConfig
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder
from pipeline.referee import agreement
from pipeline.reporting.facts import read_catalogue
from schemas.softgrip.v1.grasps_pb2 import ShardIndex
from stages.graph import STAGES
from stages.report import make_report


class Page(HTMLParser):
    """Headings, words and the sources of everything that a browser would fetch."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.sources: list[str] = []
        self.links: list[str] = []
        self.tags: list[str] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.sources += [value or "" for name, value in attrs if name == "src"]
        self.links += [value or "" for name, value in attrs if name == "href"]

    def handle_data(self, data: str) -> None:
        self.words += data


@pytest.fixture(scope="module")
def copied(run: RunFolder, tmp_path_factory: pytest.TempPathFactory) -> RunFolder:
    """The run in a place of its own, with a report."""
    folder = RunFolder(tmp_path_factory.mktemp("report") / "tiny")
    shutil.copytree(run.path, folder.path)
    make_report(folder)
    return folder


def page_of(folder: RunFolder) -> Page:
    return Page((folder.path / "report.html").read_text())


def test_the_lineage_leads_to_every_recording_or_table(copied: RunFolder) -> None:
    links = page_of(copied).links
    assert links == ["report/sources.html", *(f"{stage}.rrd" for stage in STAGES)]
    assert all((copied.path / link).is_file() for link in links)
    _, _, words = page_of(copied).words.partition("Lineage")  # the headline counts objects too
    assert words.index("sources") < words.index("objects") < words.index("attempts")


def test_a_step_without_a_recording_leads_to_its_table(copied: RunFolder, tmp_path: Path) -> None:
    recording = copied.recording("grasps")
    shutil.move(recording, tmp_path / "kept")
    make_report(copied)
    links = page_of(copied).links
    assert links[3] == "report/grasps.html"
    told = (copied.path / links[3]).read_text()
    assert "240 rows" in told
    assert told.count("<tr>") == 241
    sources = (copied.path / links[0]).read_text()
    assert all(one.name in sources for one in read_catalogue(copied.artifact("objects")).objects)
    shutil.move(tmp_path / "kept", recording)
    make_report(copied)


def test_the_page_needs_no_other_file(copied: RunFolder) -> None:
    page = page_of(copied)
    assert len(page.sources) >= 6
    assert all(source.startswith("data:image/") for source in page.sources)
    assert "script" not in page.tags


def test_the_figures_are_those_of_the_summaries(copied: RunFolder) -> None:
    words = page_of(copied).words
    train = json.loads(copied.summary("train").read_text())
    assert f"{train['test_mae']:.4f}" in words
    assert f"{train['mean_predictor_mae']:.4f}" in words
    told = " ".join(words.split())
    assert f"labels not balanced {train['test_mae_as_proposed']:.4f}" in told
    assert f"the same {train['mean_predictor_mae_as_proposed']:.4f}" in told
    for pictures, error in train["test_mae_by_pictures"].items():
        assert f"cut from {pictures} {error:.4f}" in told
    assert f"{json.loads(copied.summary('grasps').read_text())['grasps']} labelled grasps" in words
    for stage in ("objects", "scenes", "grasps", "shards", "train", "evaluate"):
        assert json.loads(copied.summary(stage).read_text())["key"][:12] in words
    evaluate = json.loads(copied.summary("evaluate").read_text())
    for result in evaluate["success_by_level"].values():
        assert f"{result['lifted']} / {result['attempts']}" in words
    assert "Apache-2.0, with softgrip" in words


def test_every_failure_has_its_cause_and_picture(copied: RunFolder) -> None:
    evaluate = json.loads(copied.summary("evaluate").read_text())
    causes = {c for r in evaluate["success_by_level"].values() for c in r["failures"]}
    text = (copied.path / "report.md").read_text()
    for cause in causes:
        assert f"**{cause}**" in text
    if not causes:
        assert "No attempt failed" in text


def test_the_markdown_shows_the_same_figures(copied: RunFolder) -> None:
    shown = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", (copied.path / "report.md").read_text())
    assert {Path(path).stem for path in shown} >= {"nsvr", "labels", "curve", "success", "timings"}
    for path in shown:
        assert (copied.path / path).stat().st_size > 1000
    for path in (copied.path / "report").glob("*.svg"):
        root = ElementTree.parse(path).getroot()
        assert root.tag.endswith("svg")
    words = "".join((copied.path / "report" / "curve.svg").read_text())
    assert "epoch" in words
    assert "[1]" in words


def test_the_same_run_gives_the_same_report(copied: RunFolder) -> None:
    files = [copied.path / "report.html", copied.path / "report.md"]
    before = [path.read_bytes() for path in files]
    make_report(copied)
    assert [path.read_bytes() for path in files] == before


def test_what_is_missing_is_said_with_its_command(run: RunFolder, tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "half")
    folder.path.mkdir()
    for path in (run.config, run.artifact("objects"), run.summary("objects")):
        shutil.copy(path, folder.path)
    make_report(folder)
    words = page_of(folder).words
    for goal in ("scenes", "train", "sweep", "eval"):
        assert f"make {goal} RUN=half" in words
    folder.summary("objects").unlink()
    with pytest.raises(ArtifactError, match="make dataset RUN=half"):
        make_report(folder)


def test_parts_of_different_states_are_told_apart(copied: RunFolder) -> None:
    assert "do not belong together" not in page_of(copied).words
    shards = copied.artifact("shards")
    before = shards.read_bytes()
    with open_artifact(shards) as artifact:
        origin, index = artifact.provenance, artifact.one(ShardIndex)
    with ArtifactWriter(shards, replace(origin, seed=origin.seed + 1)) as written:
        written.write("/index", index, log_time_ns=0)
    make_report(copied)
    assert "train was made from another shards.mcap" in page_of(copied).words
    shards.write_bytes(before)


def borne() -> dict[str, Any]:
    """Figures as `make referee` leaves them, of loads that grow with q."""
    rng = np.random.default_rng(0)
    quality, config = rng.random(60), AgreementConfig(resamples=5)
    scores = {"q": quality, "q-hat": rng.random(60)}
    found = {"borne_n": 5 * quality, "straight_n": 8 * quality}
    figures = agreement.figures_of(scores, found, np.arange(60) % 4, np.ones(60), config, rng)
    varied = agreement.varied(scores, found["borne_n"], {"friction x 2": 6 * quality}, config)
    return {**figures, "varied": varied, "ms_a_grasp": 30.0}


def test_a_sweep_and_baselines_are_shown(copied: RunFolder) -> None:
    network = {"group": "family", "test_mae": 0.2, "ms_a_grasp": 0.3, "layers": 18}
    sweep = {
        "wall_time_s": 1.0,
        "budget": {"train_samples": 10, "epochs": 2, "mean_predictor_mae": 0.3},
        "networks": [
            {**network, "channels": [8, 8, 16, 16], "chosen": True},
            {**network, "channels": [8, 8, 16, 16], "layers": 34, "chosen": False},
            {**network, "channels": [16, 16, 32, 32], "chosen": False},
        ],
    }
    copied.summary("sweep").write_text(json.dumps(sweep))
    evaluate = json.loads(copied.summary("evaluate").read_text())
    figures = next(iter(evaluate["success_by_level"].values()))
    by_level = {"by_level": {"1": 0.5}}
    evaluate["policies"] = {"ga-cnn": figures | by_level, "top <down>": figures | by_level}
    evaluate["comparisons"] = {
        "top <down>": {
            "success": 0.9,
            "baseline_success": 0.5,
            "clutters": 3,
            "p_paired": 0.25,
            "p_fisher": 0.125,
        }
    }
    copied.summary("evaluate").write_text(json.dumps(evaluate))
    judged = copied.path / "referee" / "referee.summary.json"
    judged.parent.mkdir(exist_ok=True)
    judged.write_text(json.dumps(borne()))
    make_report(copied)
    words = page_of(copied).words
    assert "3 networks on one budget of 10 grasps" in words
    assert "8-8-16-16" in (copied.path / "report" / "fig-1.svg").read_text()
    assert "top <down>" in words
    assert "0.125" in words
    assert "AUROC, bears 2 N" in words
    assert "friction x 2" in words
    assert "q-hat" in (copied.path / "report" / "load.svg").read_text()


def test_words_of_the_configuration_stay_words(copied: RunFolder) -> None:
    text = copied.config.read_text()
    copied.config.write_text(text + '\n[dataset]\ntitle = "<script>x</script> | *y*"\n')
    make_report(copied)
    page = page_of(copied)
    assert "script" not in page.tags
    assert "<script>x</script> | *y*" in page.words


def test_the_licence_of_a_mesh_folder_is_quoted(tmp_path: Path) -> None:
    from pipeline.reporting.facts import licence_of_folder

    assert licence_of_folder(tmp_path) is None
    (tmp_path / "README.md").write_text("Scans\n")
    (tmp_path / "LICENSE.txt").write_text("CC BY 4.0\n" + "x\n" * 50)
    name, text = licence_of_folder(tmp_path) or ("", "")
    assert name == "LICENSE.txt"
    assert text.splitlines()[0] == "CC BY 4.0"
    assert len(text.splitlines()) == 12
