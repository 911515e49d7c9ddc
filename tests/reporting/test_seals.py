"""Seals of a report: which are chosen, and what the figure shows of each."""

from xml.etree import ElementTree

import numpy as np

from pipeline.artifacts.tensors import to_tensor
from pipeline.recording.pads import sealed_pad
from pipeline.reporting.seals import ShownSeal, kept_and_lost, seals_figure
from schemas.softgrip.v1.evaluation_pb2 import Attempt
from tests.recording.test_pads import BLOCK, CONFIG, attempt


def ended(number: int, borne_n: float, cause: str = "", judge: str = "referee") -> Attempt:
    return Attempt(
        scene_id="s",
        attempt=number,
        outcome="failed" if cause else "lifted",
        cause=cause,
        judge=judge,
        target_body=1,
        weight_n=2.0,
        borne_n=borne_n,
    )


def test_seals_are_spread_from_the_weakest_to_the_strongest_the_lost_ones_first() -> None:
    kept = [ended(i, borne_n) for i, borne_n in enumerate([9.0, 2.5, 4.0, 6.0, 3.0])]
    lost = [ended(7, 1.0, "lost in lift"), ended(8, 0.1, "no seal")]
    chosen = kept_and_lost([*kept, *lost], each=3)
    assert [made.borne_n for made in chosen] == [0.1, 1.0, 2.5, 4.0, 9.0]


def test_what_never_met_an_object_or_was_judged_otherwise_is_no_seal() -> None:
    no_target = ended(0, 1.0, "no seal")
    no_target.target_body = 0
    others = [no_target, ended(1, 1.0, "collision"), ended(2, 3.0, judge="label")]
    assert kept_and_lost(others, each=3) == []


def test_the_figure_tells_object_and_verdict_and_is_the_same_again() -> None:
    made = attempt()
    made.weight_n = 1.5
    made.time_s.CopyFrom(to_tensor(np.arange(len(made.states)) / 15))
    pad = sealed_pad(made, ["block"], {"block": BLOCK}, CONFIG)
    assert pad is not None
    svg = seals_figure([ShownSeal(made, pad)], CONFIG)
    words = "".join(ElementTree.fromstring(svg).itertext())
    assert all(word in words for word in ("block: lifted", "gap [mm]", "vacuum [kPa]", "bears"))
    assert seals_figure([ShownSeal(made, pad)], CONFIG) == svg
