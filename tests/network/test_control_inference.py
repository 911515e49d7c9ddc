"""What control asks for quality predicts what the network predicts, the same bytes each time."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import torch

from pipeline.errors import ArtifactError, ContentError
from pipeline.execution import run_in_order
from pipeline.network.canonical import network_input
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.export import check_export
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.inference import predict
from pipeline.network.input_channels import CHANNELS
from tests.network.planes import planes_with_holes
from tests.network.test_hostile_checkpoints import model, node
from tests.network.test_inference import lively
from tests.refusals import ROOT

SAMPLES = planes_with_holes(70, seed=0)


@pytest.fixture(scope="module")
def whole(data: bytes) -> np.ndarray:
    return predicted(ControlPredictor(data, threads=1))


def predicted(predictor: ControlPredictor, some: slice | np.ndarray = slice(None)) -> np.ndarray:
    return predictor.predict(SAMPLES.cloud[some], SAMPLES.mask[some])


@pytest.mark.parametrize("batch_size", [1, 7, 64])
def test_it_predicts_what_the_network_predicts(
    network: GaCnn, data: bytes, batch_size: int
) -> None:
    predictor = ControlPredictor(data, threads=1)
    difference = check_export(predictor, network, SAMPLES.cloud, SAMPLES.mask, batch_size, 1)
    assert difference <= 1e-4


def test_another_runtime_predicts_the_same(data: bytes, whole: np.ndarray) -> None:
    inputs = network_input(torch.from_numpy(SAMPLES.cloud), torch.from_numpy(SAMPLES.mask))
    session = onnxruntime.InferenceSession(data, providers=["CPUExecutionProvider"])
    (expected,) = session.run(["quality"], {"inputs": inputs.numpy()})
    assert whole.std() > 0.01
    np.testing.assert_allclose(whole, expected, rtol=0, atol=1e-4)


def test_another_network_is_told_apart(network: GaCnn, data: bytes) -> None:
    other = lively(build_network(network.config, seed=9))
    with pytest.raises(ArtifactError, match="differs from its original"):
        check_export(ControlPredictor(data, 1), other, SAMPLES.cloud, SAMPLES.mask, 30, 1)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_a_grasp_has_the_same_bytes_whatever_is_asked_with_it(
    data: bytes, whole: np.ndarray, threads: int
) -> None:
    predictor = ControlPredictor(data, threads)
    for _ in range(5):
        assert predicted(predictor).tobytes() == whole.tobytes()
    order = np.random.default_rng(0).permutation(len(whole))
    assert predicted(predictor, order).tobytes() == whole[order].tobytes()
    for count in (0, 1, 3, 8, 9, 33):
        some = slice(20, 20 + count)
        assert predicted(predictor, some).tobytes() == whole[some].tobytes()


def test_workers_predict_the_same_bytes_on_any_core(data: bytes, whole: np.ndarray) -> None:
    for bytes_made, cores in run_in_order(asked_in_a_worker, [data] * 3, workers=2):
        assert bytes_made == whole.tobytes()
        assert cores == {frozenset(os.sched_getaffinity(0))}


def asked_in_a_worker(data: bytes) -> tuple[bytes, set[frozenset[int]]]:
    """Quality, and the cores on which each thread may run."""
    made = predicted(ControlPredictor(data, threads=1)).tobytes()
    threads = [int(task.name) for task in Path("/proc/self/task").iterdir()]
    return made, {frozenset(os.sched_getaffinity(thread)) for thread in threads}


def test_networks_that_cannot_be_run_are_refused(data: bytes) -> None:
    sides = ("batch", len(CHANNELS), 24, 24)
    for bad in (
        *(b"", b"not a network at all", data[: len(data) // 2]),
        model([node("Relu", "x")], sides=sides, gives=sides),
        model([node("Relu", "x")], sides=("batch", 8), gives=("batch", 8)),
    ):
        with pytest.raises(ContentError):
            ControlPredictor(bad, threads=1)


def test_nothing_is_said_or_kept_and_pytorch_is_not_needed(data: bytes, tmp_path: Path) -> None:
    """The runtime by itself tells Google Analytics and leaves an identifier in the home folder."""
    home, export = tmp_path / "home", tmp_path / "export.onnx"
    home.mkdir()
    export.write_bytes(data)
    program = (
        "import sys, pathlib, numpy\n"
        "from pipeline.network.control_inference import ControlPredictor\n"
        "predictor = ControlPredictor(pathlib.Path(sys.argv[1]).read_bytes(), 2)\n"
        "predictor.predict(numpy.zeros((9, 24, 24, 3)), numpy.ones((9, 24, 24), dtype=bool))\n"
        "assert sys.modules['openvino_telemetry'] is None\n"
        "assert 'torch' not in sys.modules\n"
    )
    # As on a person's machine; should it tell after all, it shall not get through.
    kept = {name: value for name, value in os.environ.items() if name not in ("CI", "TF_BUILD")}
    nowhere = {"https_proxy": "http://127.0.0.1:9", "HTTPS_PROXY": "http://127.0.0.1:9"}
    ran = subprocess.run(
        [sys.executable, "-c", program, export],
        cwd=ROOT,
        env={**kept, **nowhere, "HOME": str(home)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
    assert list(home.iterdir()) == []


def test_the_mean_over_the_symmetries_is_the_networks(network: GaCnn, data: bytes) -> None:
    few = slice(0, 11)
    cloud, mask = SAMPLES.cloud[few], SAMPLES.mask[few]
    averaged = ControlPredictor(data, threads=1).predict(cloud, mask, average_symmetries=True)
    expected = predict(network, cloud, mask, 11, threads=1, average_symmetries=True)
    np.testing.assert_allclose(averaged, expected, rtol=0, atol=1e-4)
    assert np.abs(averaged - predicted(ControlPredictor(data, threads=1), few)).max() > 1e-4
