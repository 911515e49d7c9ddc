"""A layout has every panel once, and shows topics and fields that exist."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from pipeline.interchange.foxglove_layouts import foxglove_layout
from schemas.channels import CHANNELS, channel_of
from schemas.softgrip.v1 import evaluation_pb2, grasps_pb2, objects_pb2, training_pb2

TOPICS = {
    "objects": ("/objects", "/refused"),
    "scenes": (
        *("/scenes", "/tf", "/scene/a/colour", "/scene/a/calibration", "/scene/b/colour"),
        *("/scene/b/calibration", "/scene/a/depth"),
    ),
    "grasps": ("/index",),
    "train": ("/epochs", "/result"),
    "evaluate": ("/attempts", "/levels", "/policies", "/comparisons", "/imperfection"),
    "sweep": ("/budget", "/networks"),
    "of somebody": ("/slenderness",),
}
RELEASED = Path(__file__).parents[1] / "artifacts" / "released" / "v1-0.1.0"
# Panels of Foxglove Studio's published source (its catalogue of panels, and the type of each one's
# configuration): settings that ours may have, and what these may be.
TEXT, FLAG = str, bool
SETTINGS: dict[str, dict[str, Any]] = {
    "3D": {
        "followTf": TEXT,
        "topics": {"*": {"visible": FLAG}},
        "layers": {"*": {"layerId": ("foxglove.Grid",), "visible": FLAG, "instanceId": TEXT}},
    },
    "Image": {"imageMode": {"imageTopic": TEXT, "calibrationTopic": TEXT}},
    "Plot": {
        "foxglovePanelTitle": TEXT,
        "xAxisVal": ("timestamp", "index", "custom", "currentCustom"),
        "xAxisPath": {"value": TEXT, "enabled": FLAG},
        "paths": [
            {
                "value": TEXT,
                "enabled": FLAG,
                "timestampMethod": ("receiveTime", "headerStamp"),
                "label": TEXT,
                "color": TEXT,
            }
        ],
        "showLegend": FLAG,
    },
    "RawMessages": {"topicPath": TEXT},
    "Table": {"topicPath": TEXT},
}
MESSAGES = (evaluation_pb2, grasps_pb2, objects_pb2, training_pb2)


def leaves(tree: Any) -> Iterator[str]:
    if isinstance(tree, str):
        yield tree
    elif tree is not None:
        assert tree["direction"] in ("row", "column")
        yield from leaves(tree["first"])
        yield from leaves(tree["second"])


def paths_of(value: Any) -> Iterator[str]:
    """Every text of a configuration that begins like a topic."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from paths_of(key)
            yield from paths_of(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from paths_of(inner)
    elif isinstance(value, str) and value.startswith("/"):
        yield value


@pytest.mark.parametrize("stage", TOPICS)
def test_every_panel_stands_in_the_layout_once(stage: str) -> None:
    layout = json.loads(foxglove_layout(TOPICS[stage]))
    assert sorted(leaves(layout["layout"])) == sorted(layout["configById"])
    assert layout["configById"]


@pytest.mark.parametrize("stage", TOPICS)
def test_panels_show_topics_of_the_file_and_fields_of_their_messages(stage: str) -> None:
    layout = json.loads(foxglove_layout(TOPICS[stage]))
    for path in paths_of(layout["configById"]):
        topic, _, field = path.partition(".")
        assert topic in TOPICS[stage]
        channel = channel_of(topic)
        if field:
            assert channel is not None
            name = channel.schemas[0].rpartition(".")[2]
            (message,) = (getattr(m, name) for m in MESSAGES if hasattr(m, name))
            assert field in message.DESCRIPTOR.fields_by_name


def fits(value: Any, form: Any) -> bool:
    """Whether a setting is of the form that Foxglove reads, with nothing left out or made up."""
    if isinstance(form, tuple):
        return value in form
    if isinstance(form, list):
        return isinstance(value, list) and all(fits(inner, form[0]) for inner in value)
    if isinstance(form, dict):
        named = dict.fromkeys(value, form["*"]) if "*" in form else form
        same = isinstance(value, dict) and value.keys() == named.keys()
        return same and all(fits(value[key], named[key]) for key in named)
    return type(value) is form


@pytest.mark.parametrize("stage", TOPICS)
def test_panels_are_foxgloves_own_with_settings_that_it_reads(stage: str) -> None:
    layout = json.loads(foxglove_layout(TOPICS[stage]))
    assert set(layout) == {
        *("configById", "globalVariables", "userNodes", "playbackConfig", "layout")
    }
    for name, settings in layout["configById"].items():
        kind, _, number = name.partition("!")
        assert number
        assert fits(settings, SETTINGS[kind]), (name, settings)
        for key, layer in settings.get("layers", {}).items():
            assert layer["instanceId"] == key


@pytest.mark.parametrize("stage", ["objects", "scenes", "grasps", "shards", "train", "evaluate"])
def test_a_layout_of_a_real_file_names_its_topics_and_fields(stage: str) -> None:
    """By the schemas that the file itself carries."""
    with (RELEASED / f"{stage}.mcap").open("rb") as file:
        found = make_reader(file).get_summary()
    assert found is not None
    schema_of = {
        channel.topic: found.schemas[channel.schema_id] for channel in found.channels.values()
    }
    layout = json.loads(foxglove_layout(tuple(schema_of)))
    paths = [path.partition(".") for path in paths_of(layout["configById"])]
    assert paths
    for topic, _, field in paths:
        assert topic in schema_of
        assert field.encode() in schema_of[topic].data  # names stand in a descriptor as they are


def test_a_picture_is_shown_with_its_own_cameras_intrinsics() -> None:
    panels = json.loads(foxglove_layout(TOPICS["scenes"]))["configById"]
    modes = [config["imageMode"] for name, config in panels.items() if name.startswith("Image!")]
    assert modes == [
        {"imageTopic": f"/scene/{c}/colour", "calibrationTopic": f"/scene/{c}/calibration"}
        for c in "ab"
    ]


def test_channels_have_topics_of_their_own_and_words_for_everything() -> None:
    assert len({channel.topic for channel in CHANNELS}) == len(CHANNELS)
    assert all(channel.description and channel.units and channel.schemas for channel in CHANNELS)
    assert channel_of("/scene/wrist_0/depth") is not None
    assert channel_of("/slenderness") is None
