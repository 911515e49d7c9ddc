"""Depth pictures as a video in LeRobot's layout of depth maps: HEVC Main 12, one grey channel.

LeRobot keeps depth as codes of 12 bits between ``depth_min`` and ``depth_max``. With the linear
scale chosen here a code is a millimetre, 0 is what was not measured, and the video is lossless, so
what is decoded is what the attempts hold.
"""

import io
from collections.abc import Iterable
from typing import Any, cast

import av
import numpy as np
from jaxtyping import UInt16

CODES = (1 << 12) - 1  # the largest code of 12 bits
DEPTH_MAX_M = CODES / 1000  # so that a code is a millimetre
CODEC, PIXELS = "hevc", "gray12le"
FRAMES_A_KEY = 15  # between pictures from which decoding can begin
# One thread, so that equal pictures give equal bytes; no text about the encoder in the stream.
OPTIONS = {"x265-params": "lossless=1:frame-threads=1:pools=none:info=0:log-level=none"}


def feature_of_depth(height: int, width: int, fps: int) -> dict[str, Any]:
    """The entry of such a video under ``features`` in ``meta/info.json``."""
    return {
        "dtype": "video",
        "shape": [height, width, 1],
        "names": ["height", "width", "channels"],
        "info": {
            "is_depth_map": True,
            "depth_unit": "mm",
            "video.height": height,
            "video.width": width,
            "video.codec": CODEC,
            "video.pix_fmt": PIXELS,
            "video.fps": fps,
            "video.channels": 1,
            "video.g": FRAMES_A_KEY,
            "video.extra_options": OPTIONS,
            "video.depth_min": 0.0,
            "video.depth_max": DEPTH_MAX_M,
            "video.shift": 0.0,
            "video.use_log": False,
            "has_audio": False,
        },
    }


def depth_video(pictures: Iterable[UInt16[np.ndarray, "h w"]], fps: int) -> bytes:
    """Encode depth pictures of one size as an MP4.

    Parameters
    ----------
    pictures
        Depth [mm], 0 where nothing was measured; what is farther than `DEPTH_MAX_M` counts as
        not measured.
    fps
        Pictures a second.

    Returns
    -------
    The file.
    """
    file = io.BytesIO()
    with av.open(file, "w", format="mp4") as container:
        stream: av.VideoStream | None = None
        for picture in pictures:
            if stream is None:
                added = container.add_stream(CODEC, rate=fps, options=dict(OPTIONS))
                stream = cast(av.VideoStream, added)
                stream.height, stream.width = picture.shape
                stream.pix_fmt = PIXELS
                stream.gop_size = FRAMES_A_KEY
            codes = np.where(picture <= CODES, picture, 0).astype(np.uint16)
            frame = av.VideoFrame.from_ndarray(codes, format=PIXELS)
            container.mux(stream.encode(frame))
        if stream is not None:
            container.mux(stream.encode())
    return file.getvalue()
