"""shards.rrd: how the dataset is balanced, and a walk through its clouds by growing quality."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.artifacts.reading import open_artifact
from pipeline.artifacts.sharding import listed_shards
from pipeline.clutter.levels import LEVELS
from pipeline.geometry.shape import ShapeClass
from pipeline.labelling.balancing import TENTHS, quality_histogram
from pipeline.messages.samples import read_samples, samples_of
from pipeline.network.samples import SPLITS, Samples, join_samples
from pipeline.recording import colours
from pipeline.recording.recording import (
    SHEET_SPACING,
    FinishedStage,
    eye_at,
    recording,
    time_panel,
)
from pipeline.spread import choose_evenly
from schemas.softgrip.v1.samples_pb2 import SampleBatch

TIMELINE = "sample"
# Clouds are chosen of so many samples: shuffled, they stand for all, and they fit in memory.
SHOWN_OF = 4096
SHEET_COLUMNS = 10  # clouds in a row of the sheet
CELL_RADIUS = 0.04  # a cell is drawn as a ball of this size, in r_G


def draw_shards(stage: FinishedStage, figures: Mapping[str, Any]) -> None:
    """Draw the recording from the finished shards."""
    with recording(stage, blueprint()) as stream:
        show_balance(stream, stage.output)
        wanted = stage.config.recording.clouds
        show_clouds(stream, first_samples(stage.output, "train", max(SHOWN_OF, wanted)), wanted)


def first_samples(index: Path, split: str, wanted: int) -> Samples:
    """The first samples of a split, as many messages as hold the wanted number, or all."""
    found: list[Samples] = []
    for samples in _batches(index, split):
        found.append(samples)
        if sum(map(len, found)) >= wanted:
            break
    return join_samples(found)


def _batches(index: Path, split: str) -> Iterator[Samples]:
    for shard in listed_shards(index, [split]):
        with open_artifact(shard) as artifact:
            yield from read_samples(artifact)


def blueprint() -> rrb.Blueprint:
    """Opens on the sheet of clouds; the balance stands beside it."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial3DView(
                    origin="/world/sheet",
                    name="Clouds by growing q, units of r_G",
                    eye_controls=eye_at((13.5, -36.0, 22.0), (13.5, -14.0, 0.0)),
                ),
                rrb.Spatial3DView(
                    origin="/world/cloud",
                    name="One cloud, coloured by height",
                    eye_controls=eye_at((1.3, -1.9, 1.5), (0, 0, 0)),
                ),
                row_shares=[3, 2],
            ),
            rrb.Vertical(
                rrb.Horizontal(
                    *(
                        rrb.BarChartView(origin=f"/curves/quality/{split}", name=f"q: {split}")
                        for split in ("train", "val", "test")
                    ),
                    name="q in tenths",
                ),
                rrb.BarChartView(origin="/curves/level", name="samples by level, 1 to 9"),
                rrb.BarChartView(origin="/curves/class", name="by class: basic, typical, complex"),
                rrb.TextDocumentView(origin="/notes/sample", name="Sample"),
            ),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_balance(stream: rr.RecordingStream, index: Path) -> None:
    """Bars of the whole dataset, counted message by message without clouds."""
    by_level = np.zeros(LEVELS.stop, dtype=np.int64)
    by_class = np.zeros(len(ShapeClass), dtype=np.int64)
    for split in SPLITS:
        by_tenth = np.zeros(TENTHS, dtype=np.int64)
        for shard in listed_shards(index, [split]):
            with open_artifact(shard) as artifact:
                for _, message in artifact.messages(SampleBatch):
                    rows = samples_of(message)
                    by_tenth += quality_histogram(rows.quality.astype(np.float64))
                    by_level += np.bincount(rows.level, minlength=len(by_level))
                    by_class += np.bincount(rows.shape_class, minlength=len(by_class))
        stream.log(f"curves/quality/{split}", rr.BarChart(by_tenth), static=True)
    stream.log("curves/level", rr.BarChart(by_level[1:]), static=True)
    stream.log("curves/class", rr.BarChart(by_class), static=True)


def show_clouds(stream: rr.RecordingStream, samples: Samples, wanted: int) -> None:
    """A sheet of clouds by growing q, and one after the other over the timeline."""
    order = np.argsort(samples.quality, kind="stable")
    chosen = order[choose_evenly(len(order), wanted)]
    clouds = [samples.cloud[i][samples.cloud_mask[i]].astype(np.float32) for i in chosen]
    counts = [len(cloud) for cloud in clouds]
    number = np.arange(len(chosen))
    shifts = SHEET_SPACING * np.column_stack(
        [number % SHEET_COLUMNS, -(number // SHEET_COLUMNS), np.zeros(len(chosen))]
    )
    points = np.concatenate(clouds)
    quality = colours.by_value(samples.quality[chosen].astype(np.float64))
    stream.log(
        "world/sheet",
        rr.Points3D(
            points + np.repeat(shifts, counts, axis=0),
            colors=np.repeat(quality, counts, axis=0),
            radii=CELL_RADIUS,
        ),
        static=True,
    )
    steps = [rr.TimeColumn(TIMELINE, sequence=number)]
    height = colours.by_value(points[:, 2] / 2 + 0.5)
    shown = rr.Points3D.columns(positions=points, colors=height).partition(counts)
    stream.send_columns("world/cloud", indexes=steps, columns=shown)
    stream.log("world/cloud", rr.Points3D.from_fields(radii=CELL_RADIUS), static=True)
    facts = [
        f"q = {samples.quality[i]:.3f}, p = {samples.pressure[i]:.3f}, "
        f"level {samples.level[i]}, {count} cells seen"
        for i, count in zip(chosen, counts, strict=True)
    ]
    stream.send_columns("notes/sample", indexes=steps, columns=rr.TextDocument.columns(text=facts))
