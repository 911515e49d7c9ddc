"""`make live`: the depth pictures of a recorded bag, answered in recorded time.

A picture that comes while another is worked on is skipped and counted. Writes to
runs/<run>/live/<bag>/: grasps.mcap (softgrip.v1 and foxglove messages), ros2.mcap (PoseArray and
MarkerArray in the camera's frame), and live.json with the times from picture to pose.
"""

import json
import time
from collections import Counter, defaultdict
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from loguru import logger

from pipeline.artifacts import ArtifactWriter, publish_bytes
from pipeline.camera.bags import Bag, RecordedPicture, open_bag
from pipeline.camera.frame import Frame
from pipeline.camera.live import Answered, LiveGrasps, Parts, in_recorded_time
from pipeline.camera.prediction import Prediction
from pipeline.camera.proposals import Proposals
from pipeline.config import RunConfig
from pipeline.control.ranking import NetworkRanking
from pipeline.errors import PictureError
from pipeline.execution import generator, run_command
from pipeline.interchange.ros2_answers import Ros2Answers
from pipeline.messages.foxglove import poses_in_world
from pipeline.messages.predictions import POSES_TOPIC, TOPIC, prediction_message
from pipeline.network.sources import ANALYTIC, RELEASED, quality_source
from stages.graph import RUNS_DIR
from stages.predict import predict_config, provenance

THREADS = 2  # cores of the smallest machine that is supported
QUANTILES = {"p50": 50, "p95": 95, "p99": 99}  # of the times that are reported

Reply = tuple[Frame, str, Proposals | str, dict[str, float]]
"""Picture, its frame's name in ROS, grasps or why there are none, seconds by part."""


def live(
    bag: Annotated[Path, typer.Argument(help="MCAP of ROS 2 or Foxglove, or its folder")],
    topic: Annotated[str | None, typer.Option(help="depth image or cloud, where several")] = None,
    depth_scale_m: Annotated[
        float | None, typer.Option(min=1e-9, help="metres a unit; else as ROS says")
    ] = None,
    radius_mm: Annotated[float | None, typer.Option(min=1, help="radius of the gripper")] = None,
    tilt_deg: Annotated[
        float | None, typer.Option(min=1, max=180, help="approach off the vertical; 90: sideways")
    ] = None,
    network: Annotated[
        str,
        typer.Option(
            envvar="NETWORK", help=f"'{RELEASED}', '{ANALYTIC}', or an exported network (.onnx)"
        ),
    ] = RELEASED,
    run: Annotated[str, typer.Option(envvar="RUN", help="whose run.toml configures")] = "default",
    out: Annotated[Path | None, typer.Option(help="folder; else runs/<run>/live/<bag>")] = None,
) -> None:
    """Answer every depth picture of a bag with ranked grasps, in recorded time."""
    config = predict_config(run, radius_mm, tilt_deg, None)
    source = quality_source(network, config.gripper, THREADS)
    radius_m = config.gripper.pad.radius_m
    ranking = NetworkRanking(source.predict, config.sensing, radius_m, config.evaluate.policy)
    folder = out or RUNS_DIR / run / "live" / bag.stem
    with open_bag(bag) as opened:
        proposer = LiveGrasps(ranking, config)
        began = time.perf_counter()
        warm_up(opened, topic, depth_scale_m, proposer, config)
        start_s = time.perf_counter() - began
        answered = list(
            in_recorded_time(
                opened.pictures(topic, depth_scale_m),
                lambda picture: answer(picture, proposer, config),
            )
        )
        made_from = provenance(config, [opened.path], source.digest)
    with (
        ArtifactWriter(folder / "grasps.mcap", made_from) as artifact,
        Ros2Answers(folder / "ros2.mcap", radius_m) as ros2,
    ):
        for one in answered:
            frame, frame_id, found, _ = one.answer
            if isinstance(found, str):
                continue
            prediction = Prediction(
                [frame], found, source.name, radius_m, config.predict.quality_min
            )
            artifact.write(TOPIC, prediction_message(prediction), log_time_ns=one.time_ns)
            poses = poses_in_world(found.world_from_contact, one.time_ns)
            artifact.write(POSES_TOPIC, poses, log_time_ns=one.time_ns)
            camera_from_contact = prediction.camera_from_contact
            ros2.write(camera_from_contact, found.quality, frame_id, one.time_ns)
    told = figures(answered, start_s, proposer.found_anew)
    publish_bytes(folder / "live.json", (json.dumps(told, indent=1) + "\n").encode())
    logger.info(
        "live: {} pictures answered, {} skipped, {} refused; p95 from picture to pose {:.0f} ms",
        told["answered"],
        told["skipped"],
        sum(told["refused"].values()),
        told["ms"]["picture to pose"]["p95"],
    )
    logger.info("live: {}", folder)


def warm_up(
    bag: Bag,
    topic: str | None,
    scale_m: float | None,
    proposer: LiveGrasps,
    config: RunConfig,
) -> None:
    """Compile and load everything, and find the support, on the first picture.

    A robot's program does so at its start. Done in the stream it would cost the first answer half a
    second and more, and the pictures that come meanwhile.
    """
    first = next(bag.pictures(topic, scale_m), None)
    if first is None:
        raise PictureError(f"{bag.path} holds no picture on its topic", "Record it anew")
    answer(first, proposer, config)


def answer(picture: RecordedPicture, proposer: LiveGrasps, config: RunConfig) -> Reply:
    """Grasps of one picture, or why there are none."""
    parts = Parts()
    frame, frame_id = picture.read()
    parts.done("decoding")
    rng = generator(config.seed, "live", picture.time_ns)
    try:
        return frame, frame_id, proposer.propose(frame, rng, parts), parts.seconds
    except PictureError as error:
        return frame, frame_id, str(error), parts.seconds


def figures(answered: list[Answered[Reply]], start_s: float, supports: int) -> dict[str, Any]:
    """Counts, and times from picture to pose with what they are made of."""
    times: dict[str, list[float]] = defaultdict(list)
    refused: Counter[str] = Counter()
    for one in answered:
        *_, found, seconds = one.answer
        if isinstance(found, str):
            refused[found] += 1
        times["picture to pose"].append(one.seconds)
        for part, spent in seconds.items():
            times[part].append(spent)
    replies = [one.answer[2] for one in answered]
    span_s = (answered[-1].time_ns - answered[0].time_ns) / 1e9
    return {
        "answered": len(answered),
        "with_grasps": sum(not isinstance(found, str) and len(found) > 0 for found in replies),
        "skipped": sum(one.skipped for one in answered),
        "refused": dict(refused),
        "answers_a_second": round((len(answered) - 1) / span_s, 2) if span_s else None,
        "supports_found": supports,
        "start_up_s": round(start_s, 2),
        "ms": {
            part: {
                name: round(1e3 * float(np.percentile(spent, at)), 2)
                for name, at in QUANTILES.items()
            }
            for part, spent in times.items()
        },
    }


if __name__ == "__main__":
    run_command(live)
