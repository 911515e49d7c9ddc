"""Grasps proposed on scenes whose truth is known, and on real frames."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.camera.frame import Frame
from pipeline.camera.frame_files import FrameFiles, read_frame
from pipeline.camera.frame_support import frames_that_agree
from pipeline.camera.proposals import (
    Proposals,
    apart,
    clear_of_support,
    pixels_of,
    propose_grasps,
)
from pipeline.config import RunConfig
from pipeline.config.evaluation import HandConfig
from pipeline.control.candidates import Candidates
from pipeline.control.ranking import GeometricRanking
from pipeline.errors import PictureError
from pipeline.geometry.transforms import frame_from_z
from pipeline.world.cameras import points_of_depth
from tests.camera.scenes import bin_walls, box, seen, table

CONFIG = RunConfig.model_validate({"predict": {"candidates": 160}})
SIDEWAYS = RunConfig.model_validate({"predict": {"candidates": 160, "tilt_max_rad": 1.8}})
ABOVE = (0.05, -0.35, 0.6)
REAL = os.environ.get("REAL_FRAMES_DIR")


def proposed(frames: list[Frame], config: RunConfig = CONFIG) -> Proposals:
    ranking = GeometricRanking(config.evaluate.policy.picker, config.sensing, config.gripper.pad)
    return propose_grasps(frames, ranking, config, np.random.default_rng(0))


def test_the_best_grasp_lies_on_the_boxs_top() -> None:
    target = box((0.12, 0.10, 0.08), (0.03, 0.02, 0.04))
    found = proposed([seen([table(), target], ABOVE, 0.001, posed=True)])
    best = found.world_from_contact[0]
    assert best[2, 3] == pytest.approx(0.08, abs=0.004)
    assert abs(best[0, 3] - 0.03) < 0.06
    assert abs(best[1, 3] - 0.02) < 0.05
    assert best[2, 2] > 0.95


def test_the_result_is_the_same_without_a_pose() -> None:
    target = box((0.12, 0.10, 0.08), (0.03, 0.02, 0.04))
    posed = seen([table(), target], ABOVE, 0.001, posed=True)
    unposed = seen([table(), target], ABOVE, 0.001, posed=False)
    best = proposed([unposed]).world_from_contact[0]
    world = posed.camera.world_from_camera @ best
    assert world[2, 3] == pytest.approx(0.08, abs=0.005)
    assert world[2, 2] > 0.95


def test_nothing_is_proposed_on_bin_walls() -> None:
    target = box((0.10, 0.10, 0.05), (0.0, 0.0, 0.025))
    frame = seen([table(), *bin_walls(), target], (0.0, -0.1, 0.8), 0.002, posed=True)
    places = proposed([frame]).world_from_contact[:, :3, 3]
    assert len(places) > 0
    assert (np.abs(places[:, :2]) < 0.06).all()


def test_side_approaches_are_a_matter_of_configuration() -> None:
    tower = box((0.10, 0.10, 0.25), (0.0, 0.0, 0.125))
    frame = seen([table(), tower], (0.0, -0.8, 0.25), 0.001, posed=True)
    tilts = np.arccos(proposed([frame], SIDEWAYS).world_from_contact[:, 2, 2])
    assert tilts.max() > np.radians(80)
    steep = proposed([frame])
    assert (steep.world_from_contact[:, 2, 2] > np.cos(CONFIG.predict.tilt_max_rad) - 1e-9).all()
    assert any("too steep" in reason for reason in steep.left_out)


def test_a_mask_and_labels_are_heeded() -> None:
    left = box((0.10, 0.10, 0.05), (-0.12, 0.0, 0.025))
    right = box((0.10, 0.10, 0.10), (0.12, 0.0, 0.05))
    frame = seen([table(), left, right], ABOVE, 0.001, posed=True)
    columns = np.arange(frame.camera.width_px)
    frame.allowed[:, columns > 160] = False
    labelled = Frame(**{**vars(frame), "instances": np.where(frame.depth_m > 0, 7, 0)})
    found = proposed([labelled])
    assert (found.world_from_contact[:, 0, 3] < 0).all()
    assert (found.instance == 7).all()


def test_frames_that_are_merged_need_poses() -> None:
    frame = seen([table()], ABOVE, 0.001, posed=False)
    with pytest.raises(PictureError, match="synthetic has no pose, and 2 frames"):
        proposed([frame, frame])


def test_two_views_are_merged() -> None:
    target = box((0.12, 0.10, 0.08), (0.0, 0.0, 0.04))
    views = [seen([table(), target], eye, 0.001, posed=True) for eye in (ABOVE, (-0.05, 0.35, 0.6))]
    assert proposed(views).world_from_contact[0, 2, 3] == pytest.approx(0.08, abs=0.004)


def test_frames_whose_poses_do_not_fit_are_not_merged() -> None:
    target = box((0.12, 0.10, 0.08), (0.0, 0.0, 0.04))
    one, other = (
        seen([table(), target], eye, 0.001, posed=True) for eye in (ABOVE, (-0.05, 0.35, 0.6))
    )
    rng = np.random.default_rng(0)
    assert frames_that_agree([one, other], CONFIG, rng) == [one, other]
    lifted = np.eye(4)
    lifted[2, 3] = 0.05
    assert frames_that_agree([one, other.moved(lifted)], CONFIG, rng) == [one]


def test_the_best_places_are_looked_at_more_closely() -> None:
    target = box((0.12, 0.10, 0.08), (0.0, 0.0, 0.04))
    asked: list[np.ndarray] = []

    def nearest_to_the_corner(_: object, candidates: Candidates) -> np.ndarray:
        places = candidates.world_from_contact[:, :3, 3]
        asked.append(places)
        return np.asarray(np.exp(-np.linalg.norm(places[:, :2] - (0.05, 0.04), axis=1)))

    settings = {"candidates": 160, "closer_places": 3, "closer_contacts": 10}
    config = RunConfig.model_validate({"predict": settings})
    frame = seen([table(), target], ABOVE, 0.001, posed=True)
    propose_grasps([frame], nearest_to_the_corner, config, np.random.default_rng(0))
    first, both = asked
    drawn_anew = both[len(first) :]
    assert (both[: len(first)] == first).all()
    assert 20 <= len(drawn_anew) <= 30
    none = np.zeros(len(first))
    worth = nearest_to_the_corner(None, Candidates(pose_at(first), none, none))
    best = first[apart(first, worth, config.predict.apart_m)[:3]]
    away = np.linalg.norm(drawn_anew[:, None] - best[None], axis=2).min(axis=1)
    # A contact is moved from its drawn point onto the plane around it.
    assert away.max() < config.predict.apart_m / 2 + 0.004


def pose_at(places_m: np.ndarray) -> np.ndarray:
    poses = np.tile(np.eye(4), (len(places_m), 1, 1))
    poses[:, :3, 3] = places_m
    return poses


def test_a_speck_is_no_object() -> None:
    crumb = box((0.008, 0.008, 0.02), (0.05, 0.0, 0.01))
    with pytest.raises(PictureError, match="nothing stands out of the support"):
        proposed([seen([table(), crumb], ABOVE, 0.0, posed=True)])


def test_an_empty_table_says_so() -> None:
    with pytest.raises(PictureError, match="nothing stands out of the support"):
        proposed([seen([table()], ABOVE, 0.001, posed=True)])


@given(st.integers(0, 2**31), st.floats(0.005, 0.1))
def test_what_is_kept_is_apart_and_the_best_of_its_place(seed: int, distance_m: float) -> None:
    rng = np.random.default_rng(seed)
    places, worth = rng.uniform(0, 0.2, (40, 3)), rng.random(40)
    kept = apart(places, worth, distance_m)
    gaps = np.linalg.norm(places[kept][:, None] - places[kept][None], axis=2)
    assert (gaps[~np.eye(len(kept), dtype=bool)] >= distance_m).all()
    assert (np.diff(worth[kept]) <= 0).all()
    for other in set(range(40)) - set(kept.tolist()):
        near = kept[np.linalg.norm(places[kept] - places[other], axis=1) < distance_m]
        assert worth[near].max() >= worth[other]


@pytest.mark.parametrize(
    ("height_m", "tilt_rad", "clear"),
    [(0.05, 0.0, True), (0.0, 0.0, True), (0.03, 1.5, True), (0.02, 1.5, False), (0.1, 2.8, False)],
)
def test_rim_and_stem_stay_above_the_support(height_m: float, tilt_rad: float, clear: bool) -> None:
    axis = np.array([np.sin(tilt_rad), 0.0, np.cos(tilt_rad)])
    pose = frame_from_z(np.array([0.0, 0.0, height_m]), axis)
    assert clear_of_support(pose[None], 0.025, HandConfig(), 0.001)[0] == clear


def test_pixels_are_where_points_came_from() -> None:
    frame = seen([table()], ABOVE, 0.0, posed=True)
    points, rows, columns = points_of_depth(frame.depth_m, frame.camera, 1)
    chosen = np.random.default_rng(0).choice(len(rows), 50)
    pixel, within = pixels_of(frame, points[chosen])
    assert within.all()
    assert (pixel == np.stack([columns[chosen], rows[chosen]], axis=1)).all()


@pytest.mark.skipif(REAL is None, reason="REAL_FRAMES_DIR names no folder of real depth frames")
@pytest.mark.parametrize("name", ["table_cheezit", "table_sugar", "table_mustard", "bin_suction"])
def test_real_frames_give_contacts_above_the_support(name: str) -> None:
    frame = read_frame(FrameFiles(Path(str(REAL)) / f"{name}.depth.png"))
    found = proposed([frame], SIDEWAYS)
    assert found.support is not None
    assert len(found) >= 5
    pixel, within = pixels_of(frame, found.world_from_contact[:, :3, 3])
    assert within.all()
    assert (frame.depth_m[pixel[:, 1], pixel[:, 0]] > 0).mean() > 0.8
