"""The kept network answers as it did under every instruction set, and misses on spoilt samples."""

import json
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from pipeline.execution import RunFolder
from pipeline.messages.samples import read_split
from pipeline.network.samples import Samples
from pipeline.regression.comparison import RULES
from pipeline.regression.kept_network import (
    error_on,
    read_network,
    read_samples,
    spread_over_quality,
)
from pipeline.regression.kernels import INSTRUCTION_SETS
from stages.regress import KEPT, REFERENCE
from tests.regression.conftest import ROOT

PREDICT = """
import json
from stages.regress import KEPT
from pipeline.regression.kept_network import *
network, samples = read_network(KEPT.network), read_samples(KEPT.samples)
by_both = predictions(network, samples), control_predictions(network, samples)
print(json.dumps([made.tolist() for made in by_both]))
"""


@pytest.mark.parametrize("instructions", INSTRUCTION_SETS)
def test_answers_are_those_kept_under_every_instruction_set(instructions: str) -> None:
    """In a process of its own, for the kernels are chosen when PyTorch is imported."""
    done = subprocess.run(
        [sys.executable, "-c", PREDICT],
        cwd=ROOT,
        env=os.environ | INSTRUCTION_SETS[instructions],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    reference = json.loads(REFERENCE.read_text())
    groups = ("prediction", "control_prediction")
    for group, made in zip(groups, json.loads(done.stdout), strict=True):
        kept = list(reference[group].values())
        np.testing.assert_allclose(made, kept, rtol=0, atol=RULES[group].absolute)


def test_kept_samples_span_the_quality() -> None:
    quality = read_samples(KEPT.samples).quality
    assert len(quality) == 32
    assert quality.min() < 0.05
    assert quality.max() > 0.95


def test_samples_are_taken_over_the_order_of_quality() -> None:
    samples = read_samples(KEPT.samples)
    few = spread_over_quality(samples, 5)
    in_order = np.sort(samples.quality)
    np.testing.assert_array_equal(np.sort(few.quality), in_order[[0, 8, 16, 23, 31]])


def spoilt(samples: Samples, how: str) -> Samples:
    """Samples that a defect of the pipeline could leave."""
    if how == "labels of other grasps":
        shuffled = np.random.default_rng(0).permutation(samples.quality)
        return replace(samples, quality=shuffled)
    if how == "heights upside down":
        return replace(samples, cloud=samples.cloud * np.array([1, 1, -1], dtype=np.float16))
    assert how == "all cells measured"
    return replace(samples, cloud_mask=np.ones_like(samples.cloud_mask))


@pytest.mark.parametrize(
    "how", ["labels of other grasps", "heights upside down", "all cells measured"]
)
def test_its_error_on_spoilt_samples_is_out_of_bounds(ci_run: RunFolder, how: str) -> None:
    samples = read_split(ci_run.artifact("shards"), "test")
    network = read_network(KEPT.network)
    sound = error_on(network, samples)
    found = error_on(network, spoilt(samples, how))
    assert abs(found - sound) > RULES["kept_error"].absolute
