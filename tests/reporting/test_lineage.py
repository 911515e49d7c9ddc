"""The lineage's picture: a box a step, arrows between them, links where there is a recording."""

import itertools
from xml.etree import ElementTree

from pipeline.reporting.lineage import Step, lineage_svg

SVG = "{http://www.w3.org/2000/svg}"


def test_every_step_has_a_box_and_a_link_where_there_is_a_recording() -> None:
    steps = [
        Step("sources", "49", 0, ""),
        Step("objects <b>", "47", 1_500_000, "objects.rrd"),
        Step("scenes", "9", 999, "scenes.rrd"),
    ]
    root = ElementTree.fromstring(lineage_svg(steps))
    assert len(root.findall(f".//{SVG}rect")) == 3
    assert len(root.findall(f".//{SVG}path")) == 2
    assert [a.get("href") for a in root.findall(f".//{SVG}a")] == ["objects.rrd", "scenes.rrd"]
    words = [text.text or "" for text in root.findall(f".//{SVG}text")]
    assert "objects <b>" in words
    assert "1.5 MB" in words


def test_boxes_do_not_overlap_and_stay_inside() -> None:
    root = ElementTree.fromstring(lineage_svg([Step("a", "1", 1, "")] * 7))
    left = [float(rect.get("x", "nan")) for rect in root.findall(f".//{SVG}rect")]
    width = float(root.findall(f".//{SVG}rect")[0].get("width", "nan"))
    assert all(b - a > width for a, b in itertools.pairwise(left))
    assert left[-1] + width < float(root.get("width", "nan"))
