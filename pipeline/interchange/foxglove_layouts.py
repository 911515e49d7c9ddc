"""Layouts for Foxglove, one a stage: which panels show which topics of its file.

The form is that of a layout exported by Foxglove's app: panels by id under ``configById``, and
under ``layout`` a tree of rows and columns whose leaves are these ids.
"""

import json
from collections.abc import Collection, Iterator, Sequence
from typing import Any

from pipeline.messages.foxglove import WORLD_FRAME

Panel = tuple[str, dict[str, Any]]  # type of panel, configuration
CALIBRATION, COLOUR = "/calibration", "/colour"
PALETTE = ("#4e98e2", "#f5774d", "#5cd6a9")
RAW_MESSAGES, PLOT, TABLE, IMAGE, SCENE = "RawMessages", "Plot", "Table", "Image", "3D"


def foxglove_layout(topics: Collection[str]) -> bytes:
    """The layout of a file.

    Parameters
    ----------
    topics
        Topics of the file.

    Returns
    -------
    JSON that Foxglove imports («Import from file»).
    """
    panels = list(panels_of(sorted(topics)))
    ids = [f"{kind}!{number}" for number, (kind, _) in enumerate(panels)]
    layout = {
        "configById": {name: config for name, (_, config) in zip(ids, panels, strict=True)},
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": divided(ids, "row"),
    }
    return (json.dumps(layout, indent=2) + "\n").encode()


def panels_of(topics: Sequence[str]) -> Iterator[Panel]:
    """The panels for some topics, in the order in which they are laid out.

    Parameters
    ----------
    topics
        Topics of a file, sorted.

    Yields
    ------
    Panel
        Type and configuration of each.
    """
    if "/tf" in topics:
        yield SCENE, scene_panel([topic for topic in topics if topic.endswith(CALIBRATION)])
    for topic in topics:
        if topic.endswith(COLOUR):
            yield IMAGE, image_panel(topic, topic.removesuffix(COLOUR) + CALIBRATION)
    for topic, (across, *lines) in CURVES.items():
        if topic in topics:
            yield PLOT, plot_panel(topic, across, lines)
    for topic in ("/levels", "/policies", "/comparisons", "/imperfection"):
        if topic in topics:
            yield TABLE, {"topicPath": topic}
    for topic in ("/objects", "/scenes", "/grasps", "/samples", "/attempts", "/result", "/index"):
        if topic in topics:
            yield RAW_MESSAGES, {"topicPath": topic}
    if not set(topics) & SHOWN and topics:
        yield RAW_MESSAGES, {"topicPath": topics[0]}


# Topic → the field across, and the fields drawn over it.
CURVES = {
    "/epochs": ("epoch", "train_mae", "val_mae"),
    "/networks": ("multiply_adds", "val_mae", "test_mae"),
}
SHOWN = {
    *("/tf", "/levels", "/policies", "/comparisons", "/imperfection", *CURVES),
    *("/objects", "/scenes", "/grasps", "/samples", "/attempts", "/result", "/index"),
}


def scene_panel(calibrations: Sequence[str]) -> dict[str, Any]:
    """Poses, and the cameras whose intrinsics are known, in the world's frame."""
    return {
        "followTf": WORLD_FRAME,
        "topics": {topic: {"visible": True} for topic in calibrations},
        "layers": {"grid": {"layerId": "foxglove.Grid", "visible": True, "instanceId": "grid"}},
    }


def image_panel(image: str, calibration: str) -> dict[str, Any]:
    """One camera's picture."""
    return {"imageMode": {"imageTopic": image, "calibrationTopic": calibration}}


def plot_panel(topic: str, across: str, fields: Sequence[str]) -> dict[str, Any]:
    """Fields of a topic's messages over another field of theirs."""
    return {
        "foxglovePanelTitle": topic.strip("/"),
        "xAxisVal": "custom",
        "xAxisPath": {"value": f"{topic}.{across}", "enabled": True},
        "paths": [
            {
                "value": f"{topic}.{field}",
                "enabled": True,
                "timestampMethod": "receiveTime",
                "label": field,
                "color": colour,
            }
            for field, colour in zip(fields, PALETTE, strict=False)
        ],
        "showLegend": True,
    }


def divided(ids: Sequence[str], direction: str) -> Any:
    """Halve the space for halves of the panels, rows and columns in turn.

    Parameters
    ----------
    ids
        Ids of the panels.
    direction
        "row" or "column", of the first division.

    Returns
    -------
    An id alone, or a tree of them; None without a panel.
    """
    if len(ids) < 2:
        return ids[0] if ids else None
    half, other = len(ids) // 2, "column" if direction == "row" else "row"
    return {
        "direction": direction,
        "first": divided(ids[:half], other),
        "second": divided(ids[half:], other),
    }
