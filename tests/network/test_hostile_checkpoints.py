"""A small network that declares a terabyte, or grows to one when loaded or run, costs nothing."""

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from pipeline.artifacts import ArtifactWriter, Provenance, open_artifact
from pipeline.config.learning import NetworkConfig
from pipeline.messages.training import CHECKPOINT, EXPORT
from pipeline.network.checkpoint import FORMAT, _digest, load_checkpoint_bytes
from pipeline.network.control_inference import ControlPredictor
from pipeline.network.exported import marks_of
from pipeline.network.input_channels import CHANNELS
from tests.refusals import ROOT, assert_refused_cheaply

CONFIG = NetworkConfig(layers=18, channels=(8, 8, 8, 8))
RELEASED = ROOT / "tests/artifacts/released/v1-0.1.0/train.mcap"
PROVENANCE = Provenance("train", "k", "c", "d", 7, (), "0.1.0")
TERABYTE = (2**38,)  # as the sides of an array of float32


def load(path: Path) -> None:
    """Whichever network the file holds."""
    with open_artifact(path) as artifact:
        held = artifact.attachment_sizes()
        if CHECKPOINT in held:
            load_checkpoint_bytes(artifact.attachment(CHECKPOINT))
        if EXPORT in held:
            ControlPredictor(artifact.attachment(EXPORT), threads=1)


def tensor(shape: Sequence[int], begin: int, end: int) -> dict[str, object]:
    return {"dtype": "F32", "shape": list(shape), "data_offsets": [begin, end]}


def checkpoint(
    entries: dict[str, object], payload: bytes = bytes(4), network: str | None = None
) -> bytes:
    """With its digest right, so that all of it is looked at."""
    marks = {
        **{"format": FORMAT, "version": "1", "channels": json.dumps(CHANNELS)},
        "network": CONFIG.model_dump_json() if network is None else network,
    }
    entries["__metadata__"] = marks
    marks["sha256"] = _digest(entries, payload)
    return framed(json.dumps(entries).encode()) + payload


def framed(header: bytes) -> bytes:
    return len(header).to_bytes(8, "little") + header


def of_network(**fields: object) -> bytes:
    return checkpoint({"w": tensor([1], 0, 4)}, network=json.dumps(fields))


CHECKPOINTS = {
    "header": (2**62).to_bytes(8, "little") + b"{}",
    "just_below_a_limit": (99_999_999).to_bytes(8, "little") + b"{}",
    "payload": checkpoint({"w": tensor(TERABYTE, 0, 2**40)}),
    "sides": checkpoint({"w": tensor(TERABYTE, 0, 4)}),
    "product": checkpoint({"w": tensor([2**62, 2**62], 0, 4)}),
    "none_of_many": checkpoint({"w": tensor([0, 2**62, 2**62], 0, 0)}, b""),
    "many_sides": checkpoint({"w": tensor([1] * 200, 0, 4)}),
    "offsets": checkpoint({"w": tensor([1], 2**62, 2**62 + 4)}),
    "deep": framed(b'{"x":' + b"[" * 900),
    "deep_configuration": checkpoint({"w": tensor([1], 0, 4)}, network="[" * 60_000),
    "channels": of_network(layers=102, channels=[2**40] * 4),
    "wide": of_network(layers=102, channels=[8192] * 4),
    "digits": of_network(layers=18, channels=[10**400] * 4),
    "layers": of_network(layers=10**9, channels=[8] * 4),
}


def model(
    nodes: Sequence[onnx.NodeProto],
    weights: Sequence[TensorProto] = (),
    sides: Sequence[int | str] = ("batch", 8),
    gives: Sequence[int | str] | None = None,
) -> bytes:
    """Marked as an export of ours; from ``x`` of these sides to ``q`` of those."""
    inputs = [helper.make_tensor_value_info("x", TensorProto.FLOAT, sides)]
    outputs = [helper.make_tensor_value_info("q", TensorProto.FLOAT, gives)]
    graph = helper.make_graph(nodes, "g", inputs, outputs, weights)
    made = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=10)
    for key, value in marks_of(CHANNELS).items():
        made.metadata_props.add(key=key, value=value)
    data: bytes = made.SerializeToString()
    return data


def node(
    operator: str, *inputs: str, to: str = "q", **attributes: int | list[int]
) -> onnx.NodeProto:
    made = helper.make_node(operator, inputs, [to])
    made.attribute.extend(helper.make_attribute(key, value) for key, value in attributes.items())
    return made


def shape(*sides: int) -> TensorProto:
    return numpy_helper.from_array(np.array(sides, dtype=np.int64), "s")


def ones(*sides: int) -> TensorProto:
    return numpy_helper.from_array(np.ones(sides, dtype=np.float32), "w")


def doublings(axis: int) -> list[onnx.NodeProto]:
    names = ["x", *(f"x{i}" for i in range(30)), "q"]
    return [node("Concat", at, at, to=to, axis=axis) for at, to in pairwise(names)]


def sparse() -> bytes:
    made = onnx.load_from_string(model([node("Add", "x", "w")]))
    weights = made.graph.sparse_initializer.add(dims=[2**29])
    weights.values.CopyFrom(ones(1))
    weights.indices.CopyFrom(numpy_helper.from_array(np.zeros(1, dtype=np.int64), "i"))
    data: bytes = made.SerializeToString()
    return data


EXPORTS = {
    "weights": model([node("Add", "x", "w")], [TensorProto(name="w", data_type=1, dims=TERABYTE)]),
    "sparse": sparse(),
    "elsewhere": model(
        [node("Add", "x", "w")],
        [
            TensorProto(
                name="w",
                data_type=1,
                dims=[8],
                data_location=TensorProto.EXTERNAL,
                external_data=[onnx.StringStringEntryProto(key="location", value="/etc/hostname")],
            )
        ],
    ),
    "filled": model([node("ConstantOfShape", "s", to="a"), node("Add", "a", "a")], [shape(2**28)]),
    "filled_when_run": model(
        [node("ConstantOfShape", "s", to="a"), node("Mul", "a", "x")], [shape(*TERABYTE)]
    ),
    "folded": model(
        [node("Gemm", "w", "w", to="a", transB=1), node("Add", "a", "x")], [ones(200, 1)]
    ),
    "doubled": model(doublings(axis=1)),
    "doubled_batch": model(doublings(axis=0)),
    "padded": model(
        [node("Conv", "x", "w", pads=[2**20] * 4)], [ones(1, 1, 1, 1)], ("batch", 1, 24, 24)
    ),
    "cycle": model(
        [node("Gemm", "x", "w", "b"), node("Relu", "q", to="b")], [ones(8, 8)], gives=("batch", 8)
    ),
    "given": model([node("Relu", "x")], sides=("batch", *TERABYTE)),
}


def test_a_small_network_that_declares_a_terabyte_costs_nothing(tmp_path: Path) -> None:
    def attached(name: str, kind: str, data: bytes) -> Path:
        path = tmp_path / f"{name}.mcap"
        with ArtifactWriter(path, PROVENANCE) as artifact:
            artifact.attach(kind, "application/octet-stream", data)
        return path

    hostile = [
        *(attached(f"checkpoint_{name}", CHECKPOINT, data) for name, data in CHECKPOINTS.items()),
        *(attached(f"export_{name}", EXPORT, data) for name, data in EXPORTS.items()),
    ]
    assert_refused_cheaply(load, [RELEASED], hostile)
