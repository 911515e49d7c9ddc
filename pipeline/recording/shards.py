"""shards.rrd: how the dataset is balanced, and a walk through its clouds by growing quality."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.labelling.balancing import quality_histogram
from pipeline.messages.samples import read_split
from pipeline.network.samples import SPLITS, Samples
from pipeline.recording import colours
from pipeline.recording.recording import FinishedStage, eye_at, recording, time_panel
from pipeline.spread import choose_evenly

TIMELINE = "sample"
SHEET_COLUMNS = 10  # clouds in a row of the sheet
SHEET_SPACING = 3.0  # in r_G: clouds are 2.4 wide
CELL_RADIUS = 0.04  # a cell is drawn as a ball of this size, in r_G


def draw_shards(stage: FinishedStage, figures: Mapping[str, Any]) -> None:
    """Draw the recording from the finished shards."""
    by_split = {split: read_split(stage.output, split) for split in SPLITS}
    with recording(stage, blueprint()) as stream:
        show_samples(stream, by_split, stage.config.recording.clouds)


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


def show_samples(stream: rr.RecordingStream, by_split: dict[str, Samples], wanted: int) -> None:
    """Bars of the whole dataset, and ``wanted`` training clouds from the worst to the best."""
    for split, samples in by_split.items():
        histogram = quality_histogram(samples.quality.astype(np.float64))
        stream.log(f"curves/quality/{split}", rr.BarChart(histogram), static=True)
    levels = np.concatenate([samples.level for samples in by_split.values()]).astype(np.int64)
    classes = np.concatenate([s.shape_class for s in by_split.values()]).astype(np.int64)
    by_level = np.bincount(levels, minlength=10)[1:]
    stream.log("curves/level", rr.BarChart(by_level), static=True)
    stream.log("curves/class", rr.BarChart(np.bincount(classes, minlength=3)), static=True)
    show_clouds(stream, by_split["train"], wanted)


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
