"""objects.rrd: the catalogue laid out, and each object with its convex parts and its NSVR."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from pipeline.geometry.catalogue import CatalogueObject
from pipeline.geometry.shape import COMPLEX_FROM, TYPICAL_FROM
from pipeline.messages.objects import read_objects
from pipeline.recording import colours
from pipeline.recording.recording import (
    FinishedStage,
    eye_at,
    name_curve,
    recording,
    set_step,
    start_path,
    time_panel,
)
from pipeline.recording.shapes import shown_facets, shown_mesh
from pipeline.spread import choose_evenly

TIMELINE = "object"
SPACING_M = 0.22  # between two objects on the sheet: a third more than the longest


def draw_objects(stage: FinishedStage, figures: Mapping[str, Any]) -> None:
    """Draw the recording from the finished catalogue."""
    items = list(read_objects(stage.output).values())
    shown = [items[i] for i in choose_evenly(len(items), stage.config.recording.objects)]
    opening = blueprint(len(shown), max(item.nsvr for item, _ in shown))
    with recording(stage, opening) as stream:
        show_catalogue(stream, shown)


def blueprint(objects: int, greatest_nsvr: float) -> rrb.Blueprint:
    """Opens on the whole catalogue; stepping through shows one object after the other."""
    middle = SPACING_M * (_columns(objects) - 1) / 2
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(
                origin="/world/catalogue",
                name="Catalogue, coloured by class, NSVR growing",
                eye_controls=eye_at(
                    (middle, -2.7 * middle - 0.15, 1.5 * middle + 0.15), (middle, -middle, 0.0)
                ),
            ),
            rrb.Vertical(
                rrb.Spatial3DView(
                    origin="/world/object",
                    name="Object (left) and its convex parts",
                    eye_controls=eye_at((0.1, -0.25, 0.15), (0.1, 0.0, 0.0)),
                ),
                rrb.TimeSeriesView(
                    origin="/curves/nsvr",
                    name="NSVR by object, and the two thresholds of its classes",
                    axis_y=rrb.ScalarAxis(range=(2.0, greatest_nsvr + 0.2)),
                    plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.LeftTop),
                ),
                rrb.TextDocumentView(origin="/notes/object", name="Facts"),
                row_shares=[4, 3, 3],
            ),
            column_shares=[3, 2],
        ),
        time_panel(TIMELINE),
        collapse_panels=True,
    )


def show_catalogue(
    stream: rr.RecordingStream, items: Sequence[tuple[CatalogueObject, str]]
) -> None:
    """Every object on a grid, and a step of the timeline for each, by growing NSVR."""
    columns = _columns(len(items))
    for threshold, name, shape_class in (
        (TYPICAL_FROM, "typical_from", "typical"),
        (COMPLEX_FROM, "complex_from", "complex"),
    ):
        label = f"{shape_class} from {threshold}"
        name_curve(stream, f"curves/nsvr/{name}", label, colours.SHAPE_CLASS[shape_class])
        for index in range(len(items)):
            set_step(stream, TIMELINE, index)
            stream.log(f"curves/nsvr/{name}", rr.Scalars(threshold))
    for shape_class, colour in colours.SHAPE_CLASS.items():
        stream.log(
            f"curves/nsvr/{shape_class}",
            rr.SeriesPoints(names=shape_class, colors=colour, marker_sizes=4),
            static=True,
        )
    for index, (item, split) in enumerate(sorted(items, key=lambda pair: pair[0].nsvr)):
        place = SPACING_M * np.array([index % columns, -(index // columns), 0.0])
        colour = colours.SHAPE_CLASS[item.shape_class]
        path = f"world/catalogue/{rr.escape_entity_path_part(item.name)}"
        stream.log(path, shown_mesh(item.mesh, colour), static=True)
        stream.log(path, rr.Transform3D(translation=place), static=True)
        stream.log(
            f"{path}/label",
            rr.Points3D(
                [[0.0, 0.0, 0.7 * item.mesh.extents_m[2]]],
                labels=[f"{item.name} {item.nsvr:.2f}"],
                radii=0.0005,
                colors=colours.PALETTE[7],
                show_labels=len(items) <= 20,
            ),
            static=True,
        )
        set_step(stream, TIMELINE, index)
        _show_object(stream, start_path(stream, "world/object", index), item, split)


def _show_object(stream: rr.RecordingStream, path: str, item: CatalogueObject, split: str) -> None:
    stream.log(f"{path}/mesh", shown_mesh(item.mesh, colours.SHAPE_CLASS[item.shape_class]))
    beside = [1.3 * item.mesh.extents_m[0] + 0.02, 0.0, 0.0]
    stream.log(f"{path}/parts", rr.Transform3D(translation=beside))
    for number, part in enumerate(item.convex_parts):
        stream.log(f"{path}/parts/{number}", shown_facets(part, colours.by_index(number)))
    stream.log(f"curves/nsvr/{item.shape_class}", rr.Scalars(item.nsvr))
    repairs = "; ".join(item.repairs) or "none: closed as it came"
    stream.log(
        "notes/object",
        rr.TextDocument(
            f"**{item.name}** ({split})\n\n"
            f"| | |\n|-|-|\n"
            f"| class | {item.shape_class}, NSVR {item.nsvr:.3f} |\n"
            f"| longest extent | {1e3 * item.target_extent_m:.1f} mm (scale {item.scale:.4g}"
            f"{_stretch(item)}) |\n"
            f"| mass | {1e3 * item.mass_kg:.0f} g |\n"
            f"| faces, convex parts | {len(item.mesh.faces)}, {len(item.convex_parts)} |\n"
            f"| source | {item.source}, unit {item.unit} ({item.unit_known_by}) |\n"
            f"| repairs | {repairs} |\n"
            f"| copies left out | {', '.join(item.copies) or 'none'} |\n",
            media_type=rr.MediaType.MARKDOWN,
        ),
    )


def _stretch(item: CatalogueObject) -> str:
    if np.all(item.stretch == 1.0):
        return ""
    return ", stretched " + " x ".join(f"{factor:.2f}" for factor in item.stretch)


def _columns(objects: int) -> int:
    return int(np.ceil(np.sqrt(objects)))
