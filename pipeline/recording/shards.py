"""shards.rrd: how the dataset is balanced, and a walk through its clouds by growing quality."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.artifacts.sample_messages import Samples
from pipeline.gripper.balancing import quality_histogram
from pipeline.recording import colours
from pipeline.recording.recording import looking, spread, step, time_panel

TIMELINE = "sample"
SHEET_COLUMNS = 10
SHEET_SPACING = 3.0  # in r_G: clouds are 2.4 wide


def blueprint() -> rrb.Blueprint:
    """Opens on the sheet of clouds; the balance stands beside it."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(
                rrb.Spatial3DView(
                    origin="/world/sheet",
                    name="Clouds by growing q, units of r_G",
                    eye_controls=looking((13.5, -45.0, 30.0), (13.5, -13.0, 0.0)),
                ),
                rrb.Spatial3DView(
                    origin="/world/cloud",
                    name="One cloud, coloured by height",
                    eye_controls=looking((1.6, -2.2, 1.6), (0, 0, 0)),
                ),
                row_shares=[3, 2],
            ),
            rrb.Vertical(
                rrb.BarChartView(origin="/curves/quality/train", name="q in tenths: train"),
                rrb.BarChartView(origin="/curves/quality/test", name="q in tenths: test"),
                rrb.BarChartView(origin="/curves/level", name="samples by level, 1 to 9"),
                rrb.BarChartView(origin="/curves/class", name="basic, typical, complex"),
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
    train = by_split["train"]
    order = np.argsort(train.quality, kind="stable")
    chosen = order[spread(len(order), wanted)]
    for number, index in enumerate(chosen):
        points = train.cloud[index][train.cloud_mask[index]].astype(np.float32)
        quality = float(train.quality[index])
        shift = SHEET_SPACING * np.array([number % SHEET_COLUMNS, -(number // SHEET_COLUMNS), 0])
        stream.log(
            f"world/sheet/{number:03d}",
            rr.Points3D(points + shift, colors=colours.by_value(np.array([quality])), radii=0.04),
            static=True,
        )
        step(stream, TIMELINE, number)
        height = points[:, 2] / 2 + 0.5 if len(points) else np.zeros(0)
        stream.log("world/cloud", rr.Points3D(points, colors=colours.by_value(height), radii=0.04))
        stream.log(
            "notes/sample",
            rr.TextDocument(
                f"q = {quality:.3f}, p = {float(train.pressure[index]):.3f}, "
                f"level {int(train.level[index])}, {len(points)} cells seen"
            ),
        )
