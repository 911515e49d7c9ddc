"""The shuffle in two passes against one in memory, interrupted, and with any number of workers."""

import hashlib
import pickle
import shutil
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import fields, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest
from scipy.stats import chisquare

from pipeline.artifacts import ArtifactWriter
from pipeline.artifacts.sharding import listed_shards, read_index
from pipeline.asking.cache import QUERY_CACHE, arrow_table
from pipeline.asking.expectations import check_expectations
from pipeline.asking.query import ask
from pipeline.asking.rows import ROWS
from pipeline.benchmarks.shuffling import write_synthetic_grasps
from pipeline.config import RunConfig
from pipeline.errors import ArtifactError
from pipeline.execution import RunFolder, StageContext, generator, shuffling
from pipeline.execution.shuffle_plan import drawn, order_within, plan_shuffle
from pipeline.execution.staleness import stage_context
from pipeline.messages.grasp_samples import read_all_grasps
from pipeline.messages.samples import object_names_in, read_split
from pipeline.network.samples import SPLITS, Samples
from pipeline.network.shuffling import positions_in
from stages import shards
from stages.graph import SHARDS, inputs_of

SAMPLES, SCENE, PART, SHARD = 360, 24, 110, 40
T = TypeVar("T")
R = TypeVar("R")

SETTINGS = f"seed = 3\n[shards]\nsamples_per_part = {PART}\nsamples_per_shard = {SHARD}\n"


@pytest.fixture(scope="module")
def grasps(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run up to its grasps."""
    folder = tmp_path_factory.mktemp("shuffled") / "run"
    write_synthetic_grasps(folder, SAMPLES, SCENE, distinct=SAMPLES // SCENE)
    (folder / "run.toml").write_text(SETTINGS)
    return folder


def ready(grasps: Path, to: Path, workers: int = 1) -> StageContext:
    """Stage shards of a copy of the run."""
    shutil.copytree(grasps, to)
    return stage_context(SHARDS, RunFolder(to), inputs_of, None, workers)


def digests(stage: StageContext) -> dict[str, str]:
    files = [stage.output, *stage.shards.rglob("*.mcap")]
    return {
        path.relative_to(stage.folder.path).as_posix(): hashlib.sha256(
            path.read_bytes()
        ).hexdigest()
        for path in files
    }


@pytest.fixture(scope="module")
def done(grasps: Path, tmp_path_factory: pytest.TempPathFactory) -> StageContext:
    stage = ready(grasps, tmp_path_factory.mktemp("one") / "run")
    shards.build(stage)
    return stage


def in_memory(grasps: Path, config: RunConfig, split: str) -> Samples:
    """All samples of a split at once: a part drawn for each, then each part permuted."""
    samples = read_all_grasps(grasps)[1][split]
    drawn: list[int] = []
    for number, entry in enumerate(read_index(grasps).shards):
        if entry.split == split:
            rng = generator(config.seed, "scatter", split, number)
            drawn += [n // PART for n in rng.integers(0, len(samples), entry.samples).tolist()]
    order: list[int] = []
    for part in range(-(-len(samples) // PART)):
        mine = np.flatnonzero(np.array(drawn) == part)
        names = ("shuffle", split, part) if part else ("shuffle", split)
        order += mine[generator(config.seed, *names).permutation(len(mine))].tolist()
    return samples.take(np.array(order))


@pytest.mark.parametrize("split", SPLITS)
def test_two_passes_give_the_order_of_a_shuffle_in_memory(done: StageContext, split: str) -> None:
    expected = in_memory(done.upstream("grasps"), done.config, split)
    found = read_split(done.output, split)
    assert len(found) > PART or split != "train"
    for field in fields(Samples):
        stored = getattr(found, field.name)
        np.testing.assert_array_equal(stored, getattr(expected, field.name).astype(stored.dtype))
    names, _ = read_all_grasps(done.upstream("grasps"))
    assert {object_names_in(path) for path in listed_shards(done.output)} == {names}


def test_a_split_of_one_part_keeps_the_order_of_one_permutation(done: StageContext) -> None:
    """So runs that one part holds have the bytes that they had before there were parts."""
    samples = read_all_grasps(done.upstream("grasps"))[1]["val"]
    assert len(samples) <= PART
    order = generator(done.config.seed, "shuffle", "val").permutation(len(samples))
    np.testing.assert_array_equal(
        read_split(done.output, "val").quality, samples.take(order).quality
    )


def test_clouds_without_a_point_are_counted(done: StageContext, tmp_path: Path) -> None:
    part = plan_shuffle(done.config, done.upstream("grasps"), done.shards).parts[0]
    samples = read_split(done.output, part.split).take(slice(0, part.samples))
    mask = np.ones_like(samples.cloud_mask)
    mask[[2, 5]] = False
    mask[7, 1:] = False
    names = read_all_grasps(done.upstream("grasps"))[0]
    below, rows = done.output.parent, tmp_path / "rows.arrow"
    job = shuffling.GatherJob(part, (), names, done.config, done.provenance(), below, rows)
    found = shuffling.counted(job, [replace(samples, cloud_mask=mask)])
    assert (found.empty, found.seen, found.cells) == (2, int(mask.sum()), mask.size)


def test_jobs_done_elsewhere_in_any_order_write_the_same_bytes(
    grasps: Path, done: StageContext, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As processes do them: each job and result pickled, the last job first."""
    stage = ready(grasps, tmp_path / "run", workers=2)

    def backwards(job: Callable[[T], R], items: list[T], *_: object, **__: object) -> list[R]:
        pickled = pickle.dumps(items[::-1])
        results = [pickle.dumps(job(item)) for item in pickle.loads(pickled)]  # noqa: S301 - ours
        return [pickle.loads(result) for result in results[::-1]]  # noqa: S301 - ours

    monkeypatch.setattr(shards, "run_in_order", backwards)
    shards.build(stage)
    assert digests(stage) == digests(done)
    assert not stage.folder.state("shards").exists()


def rows_kept(stage: StageContext) -> list[dict[str, object]]:
    """Table samples as the stage left it, no sample read for it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(ROWS, "samples", lambda path: pytest.fail(f"{path} is read for its rows"))
        table = arrow_table("samples", stage.output, stage.folder.state(QUERY_CACHE))
    rows: list[dict[str, object]] = table.to_pylist()
    return rows


def test_the_rows_that_the_stage_leaves_are_those_of_its_shards(
    done: StageContext, tmp_path: Path
) -> None:
    read_back = arrow_table("samples", done.output, tmp_path / "query").to_pylist()
    assert len(read_back) == SAMPLES
    assert rows_kept(done) == read_back
    # Each part has words of its own, and SQL tells them apart.
    sql = "SELECT split, object, count(*) AS n FROM samples GROUP BY ALL ORDER BY ALL"
    answer = ask(sql, {"shards": done.output}, done.folder.state(QUERY_CACHE)).to_pylist()
    counts = Counter((str(row["split"]), str(row["object"])) for row in read_back)
    assert {(row["split"], row["object"]): row["n"] for row in answer} == counts


def test_its_check_reads_no_sample_back(
    done: StageContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever is asked of samples, in one part or many, is answered by the rows that it left."""
    monkeypatch.setitem(ROWS, "samples", lambda path: pytest.fail(f"{path} is read for rows"))
    made = {"grasps": done.upstream("grasps"), "shards": done.output}
    found = check_expectations("shards", (), made, done.folder.state(QUERY_CACHE))
    assert len(found) > 2
    assert not [one for one in found if one.problem and one.expected.name != "provenance is whole"]
    assert done.checking.seconds > 0  # of writing them: it counts as part of the check


class KilledError(Exception):
    """In the place of a kill."""


@pytest.mark.parametrize("share", [0.2, 0.7, 0.9])
def test_interrupted_it_goes_on_from_what_is_whole(
    grasps: Path,
    done: StageContext,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    share: float,
) -> None:
    """Killed in the first pass, in the second, and between the shards of one part."""
    stage = ready(grasps, tmp_path / "run")
    writes = count_writes(monkeypatch, int(share * len(count_all(done))))
    with pytest.raises(KilledError):
        shards.build(stage)
    kept = {p: p.stat().st_mtime_ns for p in stage.folder.path.rglob("*.mcap") if is_made(p)}
    assert kept
    whole = len(list(stage.shards.rglob("*.mcap")))
    monkeypatch.undo()
    again = count_writes(monkeypatch, None)
    shards.build(stage)
    assert digests(stage) == digests(done)
    assert rows_kept(stage) == rows_kept(done)
    left = [path for path in kept if path.exists()]
    assert all(path.stat().st_mtime_ns == kept[path] for path in left)
    assert len(left) == whole
    # What was whole was not written again; what was gathered was not scattered again.
    assert len(writes) - 1 + len(again) == len(count_all(done))


def is_made(path: Path) -> bool:
    return "grasps" not in path.as_posix().split("/run/")[1]


def count_all(done: StageContext) -> list[Path]:
    """Every file that an uninterrupted stage writes."""
    plan = plan_shuffle(done.config, done.upstream("grasps"), done.shards)
    scattered = [Path(str(p.number)) for p in plan.parts for count in p.counts if count]
    return scattered + [shard for part in plan.parts for shard in part.shards]


def count_writes(monkeypatch: pytest.MonkeyPatch, most: int | None) -> list[Path]:
    """Note each file as it is begun, and end the stage at the one after ``most``."""
    begun: list[Path] = []

    def writer(path: Path, *args: object, **options: object) -> object:
        begun.append(path)
        if most is not None and len(begun) > most:
            raise KilledError
        return ArtifactWriter(path, *args, **options)  # type: ignore[arg-type]

    monkeypatch.setattr("pipeline.execution.shuffling.ArtifactWriter", writer)
    return begun


def test_scattered_files_are_gone_as_soon_as_they_are_gathered(
    grasps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = ready(grasps, tmp_path / "run")
    plan = plan_shuffle(stage.config, stage.upstream("grasps"), stage.shards)
    at_start: list[int] = []
    really = shuffling.read_scattered

    def watched(job: shuffling.GatherJob) -> Iterator[Samples]:
        at_start.append(len(list(stage.folder.state("shards").rglob("*.mcap"))))
        return really(job)

    monkeypatch.setattr(shuffling, "read_scattered", watched)
    shards.build(stage)
    files = [sum(count > 0 for count in part.counts) for part in plan.parts]
    assert at_start == [sum(files[number:]) for number in range(len(files))]


def test_a_disk_without_room_is_told_before_anything_is_written(
    grasps: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stage = ready(grasps, tmp_path / "run")
    used = shutil.disk_usage(tmp_path)._replace(free=1000)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: used)
    with pytest.raises(ArtifactError, match=r"Shuffling takes up to \d+ MiB .* disk is full"):
        shards.build(stage)
    assert not [path for path in stage.folder.path.rglob("*.mcap") if is_made(path)]


def test_a_way_is_uniform_over_the_shards(grasps: Path) -> None:
    """Samples of one scene, over many seeds: each piece of the split gets its share of them."""
    settings = {"samples_per_part": PART, "samples_per_shard": SHARD}
    pieces, seeds = 12, 60
    counts = np.zeros(pieces)
    for seed in range(seeds):
        config = RunConfig.model_validate({"seed": seed, "shards": settings})
        plan = plan_shuffle(config, grasps / "grasps.mcap", grasps / "shards")
        train = sum(part.samples for part in plan.parts if part.split == "train")
        for part, sent in enumerate(np.bincount(drawn(plan.groups[0][:1], config))):
            # What the first scene sends comes first.
            came = positions_in(order_within(plan.parts[part], seed))[:sent]
            position = plan.parts[part].first + came
            counts += np.bincount(position * pieces // train, minlength=pieces)
    assert counts.sum() == seeds * SCENE
    assert chisquare(counts).pvalue > 1e-3
