"""Ranked grasps as JSON and CSV, for a robot's program and for a person to read."""

import csv
import io
import json
from typing import Any

from pipeline.camera.prediction import Prediction
from pipeline.geometry.transforms import position_quaternion

COLUMNS = (
    "rank",
    "quality",
    "good",
    "pixel_column",
    "pixel_row",
    "instance",
    *(
        f"{frame}_{name}"
        for frame in ("camera", "world")
        for name in (
            *(f"position_{axis}_m" for axis in "xyz"),
            *(f"approach_{axis}" for axis in "xyz"),
            *(f"quaternion_{part}" for part in "wxyz"),
        )
    ),
    "roughness_m",
)


def grasps_json(prediction: Prediction) -> str:
    """All grasps, the best first, with frames and units named.

    A pose's +z points out of the object; the gripper moves along ``approach``, which is -z.
    """
    proposals = prediction.proposals
    support = proposals.support
    record = {
        "format": "softgrip ranked grasps, version 1",
        "units": "metres; quaternions are (w, x, y, z); pixels are (column, row)",
        "frames": [frame.name for frame in prediction.frames],
        "world": "the frames' own" if prediction.frames[0].posed else "CCS of the first frame",
        "ranking": prediction.ranking,
        "gripper_radius_m": prediction.radius_m,
        "quality_min": prediction.quality_min,
        "verdict": prediction.verdict,
        "left_out": proposals.left_out,
        "support": None
        if support is None
        else {
            "world_from_support": support.world_from_support.tolist(),
            "walls": len(support.walls),
        },
        "grasps": [_grasp(prediction, index) for index in range(len(proposals))],
    }
    return json.dumps(record, indent=1) + "\n"


def grasps_csv(prediction: Prediction) -> str:
    """A row a grasp, the best first, with the columns of `COLUMNS`."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    for index in range(len(prediction.proposals)):
        grasp = _grasp(prediction, index)
        row = [grasp["rank"], grasp["quality"], int(grasp["good"]), *grasp["pixel"]]
        row.append(grasp["instance"])
        for frame in ("camera", "world"):
            for part in ("position_m", "approach", "quaternion"):
                row += grasp[frame][part]
        writer.writerow([*row, grasp["roughness_m"]])
    return text.getvalue()


def _grasp(prediction: Prediction, index: int) -> dict[str, Any]:
    proposals = prediction.proposals
    column, row = prediction.pixel[index]
    quality = float(proposals.quality[index])
    return {
        "rank": index + 1,
        "quality": round(quality, 4),
        "good": quality >= prediction.quality_min,
        "pixel": [int(column), int(row)],
        "instance": int(proposals.instance[index]),
        "camera": _pose(prediction.camera_from_contact[index]),
        "world": _pose(proposals.world_from_contact[index]),
        "roughness_m": round(float(proposals.roughness_m[index]), 6),
    }


def _pose(pose: Any) -> dict[str, list[float]]:
    position, quaternion = position_quaternion(pose)
    return {
        "position_m": [round(float(value), 6) for value in position],
        "approach": [round(float(-value), 6) for value in pose[:3, 2]],
        "quaternion": [round(float(value), 6) for value in quaternion],
    }
