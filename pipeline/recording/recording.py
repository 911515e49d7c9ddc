"""One Rerun recording a stage: how it is opened, named, bounded and published.

Entity paths and the timeline are named alike across stages: what is in the
world lies under ``/world``, pictures under ``/camera``, curves under
``/curves``, words under ``/notes``; the one timeline of a recording is named
by what it steps through (``object``, ``scene``, ``grasp``, ``epoch``, ...).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from pipeline.artifacts.publishing import published

APPLICATION = "softgrip"


@contextmanager
def recording(
    path: Path, stage: str, recording_id: str, blueprint: rrb.Blueprint
) -> Iterator[rr.RecordingStream]:
    """Open the recording of a stage; it appears at ``path`` when the block ends well.

    recording_id : the stage's key, so that equal runs open as the same recording.
    """
    with published(path) as scratch:
        stream = rr.RecordingStream(f"{APPLICATION}_{stage}", recording_id=recording_id)
        stream.save(scratch, default_blueprint=blueprint)
        try:
            yield stream
        finally:
            stream.flush()
            stream.disconnect()


def step(stream: rr.RecordingStream, timeline: str, index: int) -> None:
    """Move to step ``index`` of the recording's one timeline."""
    stream.set_time(timeline, sequence=index)


def spread(total: int, wanted: int) -> list[int]:
    """Indices of at most ``wanted`` items, evenly spread over ``total``."""
    if total <= wanted:
        return list(range(total))
    return sorted({round(i * (total - 1) / max(wanted - 1, 1)) for i in range(wanted)})
