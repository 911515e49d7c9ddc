"""A graph traced once and filled with weights is what the exporter makes of those weights."""

import copy
from pathlib import Path

import onnx
import pytest
import torch

from pipeline.config.learning import NetworkConfig
from pipeline.network import traced
from pipeline.network.ga_cnn import GaCnn, build_network
from pipeline.network.traced import optimized_graph, strip_origins
from tests.network.test_inference import lively

CELLS = 12
CONFIG = NetworkConfig(layers=18, channels=(8, 8, 16, 16))


def exported_in_one_go(network: GaCnn) -> onnx.ModelProto:
    example = torch.zeros(2, len(network.channels), CELLS, CELLS)
    program = torch.onnx.export(
        network,
        (example,),
        dynamo=True,
        dynamic_shapes=({0: torch.export.Dim("batch")},),
        input_names=["inputs"],
        output_names=["quality"],
        verbose=False,
    )
    model: onnx.ModelProto = program.model_proto  # type: ignore[union-attr]
    return model


def stripped(model: onnx.ModelProto) -> bytes:
    strip_origins(model)
    data: bytes = model.SerializeToString(deterministic=True)
    return data


def test_traced_for_one_network_it_serves_every_other_of_this_shape(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(traced, "_FOLDER", tmp_path)
    fresh = build_network(CONFIG, seed=1).eval()
    trained = lively(build_network(CONFIG, seed=0)).eval()
    one_go = [stripped(exported_in_one_go(copy.deepcopy(n))) for n in (fresh, trained)]
    assert one_go[0] != one_go[1]
    assert stripped(optimized_graph(fresh, CELLS)) == one_go[0]
    (kept,) = tmp_path.iterdir()
    assert kept.stat().st_size < len(one_go[0])  # no weights
    monkeypatch.setattr(torch.onnx, "export", None)  # fails if it is called
    assert stripped(optimized_graph(trained, CELLS)) == one_go[1]


def test_another_shape_has_a_graph_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(traced, "_FOLDER", tmp_path)
    asked = []

    def note(path: Path, make: object) -> bytes:
        asked.append(path)
        return onnx.ModelProto(
            ir_version=10,
            graph=onnx.GraphProto(name="none"),
            opset_import=[onnx.OperatorSetIdProto(version=20)],
            metadata_props=[onnx.StringStringEntryProto(key="names given", value="0")],
        ).SerializeToString()

    monkeypatch.setattr(traced, "kept_bytes", note)
    network = build_network(CONFIG, seed=0)
    optimized_graph(network, CELLS)
    optimized_graph(build_network(CONFIG, seed=1), CELLS)
    assert len(set(asked)) == 1
    optimized_graph(network, CELLS + 1)
    for changed in (
        {"layers": 20},
        {"channels": (8, 8, 16, 24)},
        {"attention": "none"},
    ):
        optimized_graph(build_network(CONFIG.model_copy(update=changed), seed=0), CELLS)
    assert len(set(asked)) == 5
