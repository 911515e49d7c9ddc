"""Two runs in one picture: bars of one scale, A and B beside each other, nothing of what is not."""

from pathlib import Path

import numpy as np
import rerun as rr
from rerun.chunk import RrdReader

from pipeline.recording.diff import SIDES, blueprint, show_diff


def test_bars_of_both_runs_stand_beside_each_other_with_their_values(tmp_path: Path) -> None:
    values = ([0.1, 0.3, 0.2], [0.2, 0.1, 0.4])
    with rr.RecordingStream("diff") as stream:
        stream.save(tmp_path / "diff.rrd")
        show_diff(stream, {}, {}, values, ([], []), "words")
    found = {}
    for chunk in RrdReader(tmp_path / "diff.rrd").stream():
        batch = chunk.to_record_batch()
        if chunk.entity_path.startswith("/curves/"):
            (bars,), (places,), (widths,) = (
                batch[f"BarChart:{name}"].to_pylist() for name in ("values", "abscissa", "widths")
            )
            numbers = (np.array(b[0]["buffer"]) for b in (bars, places))
            found[chunk.entity_path] = (*numbers, np.array(widths))
    assert sorted(found) == [f"/curves/error/{side}" for side in SIDES]
    for side, heights in zip(SIDES, values, strict=True):
        assert found[f"/curves/error/{side}"][0].tolist() == heights
    a, b = (found[f"/curves/error/{side}"] for side in SIDES)
    np.testing.assert_allclose(a[1] + a[2], b[1], atol=1e-6)
    assert (b[1][:-1] + b[2][:-1] < a[1][1:]).all()


def test_what_was_not_compared_has_no_view() -> None:
    layout = blueprint(("one", "other"), ["error"])
    (bars, words) = layout.root_container.contents
    assert [view.origin for view in bars.contents] == ["/curves/error"]
    assert "A one, B other" in bars.contents[0].name
    assert words.origin == "/notes/result"
