"""The graph that PyTorch's exporter traces of a network, kept by the network's shape.

Tracing takes seven seconds of processor, whatever the weights. All the rest takes half a second:
the weights are put into the kept graph, and the exporter's own optimizer is run on it.
"""

import hashlib
import importlib.metadata
import json
import logging
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import onnx
import onnx_ir
import torch
from torch import Tensor

from pipeline.artifacts.kept_bytes import kept_bytes
from pipeline.network.ga_cnn import GaCnn

_INPUT, _OUTPUT = "inputs", "quality"
# Beside what Python and numba compile of this package: as old as the code, and ignored by Git.
_FOLDER = Path(__file__).parent / "__pycache__"
_CODE = [Path(__file__).with_name(name) for name in ("traced.py", "export.py", "ga_cnn.py")]
_PACKAGES = ("torch", "onnx", "onnx-ir", "onnxscript")
_NAMES_GIVEN = "names given"  # key in the metadata of a traced graph


def optimized_graph(network: GaCnn, cells: int) -> onnx.ModelProto:
    """What the exporter makes of a network, with a batch of any size.

    Parameters
    ----------
    network
        The network, ready for prediction; its weights lie in rows (``contiguous_format``).
    cells
        Cells a side of the clouds that it will predict.

    Returns
    -------
    The graph with the network's weights.
    """
    data = kept_bytes(_FOLDER / f"traced.{_key(network, cells)}", lambda: _trace(network, cells))
    return _with_weights(data, network.state_dict())


def strip_origins(model: onnx.ModelProto) -> None:
    """Remove the traces of source files that the exporter leaves: they differ by machine.

    Parameters
    ----------
    model
        The graph; changed in place.
    """
    del model.metadata_props[:]
    del model.graph.metadata_props[:]
    model.doc_string = model.graph.doc_string = ""
    for node in model.graph.node:
        del node.metadata_props[:]
        node.doc_string = ""
    for value in model.graph.value_info:
        del value.metadata_props[:]
    for weights in model.graph.initializer:
        del weights.metadata_props[:]


def _key(network: GaCnn, cells: int) -> str:
    """Of all that decides the graph before the weights are put in."""
    versions = [importlib.metadata.version(name) for name in _PACKAGES]
    shape = [network.config.model_dump(mode="json"), network.channels, cells]
    digest = hashlib.sha256(json.dumps([versions, shape]).encode())
    for path in _CODE:
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _trace(network: GaCnn, cells: int) -> bytes:
    """The graph as traced, without weights."""
    example = torch.zeros(2, len(network.channels), cells, cells)
    with _quiet_exporter():
        program = torch.onnx.export(
            network,
            (example,),
            dynamo=True,
            dynamic_shapes=({0: torch.export.Dim("batch")},),
            input_names=[_INPUT],
            output_names=[_OUTPUT],
            verbose=False,
            optimize=False,
        )
    traced: onnx.ModelProto = program.model_proto  # type: ignore[union-attr]
    strip_origins(traced)
    of_network = network.state_dict().keys()
    for weights in traced.graph.initializer:
        if weights.name in of_network:
            weights.ClearField("raw_data")
    given = _name_a_node(program.model.graph)  # type: ignore[union-attr]
    traced.metadata_props.add(key=_NAMES_GIVEN, value=str(given))
    data: bytes = traced.SerializeToString(deterministic=True)
    return data


def _with_weights(data: bytes, state: Mapping[str, Tensor]) -> onnx.ModelProto:
    """The traced graph with a network's weights, optimized as the exporter does."""
    traced = onnx.load_from_string(data)
    for weights in traced.graph.initializer:
        if weights.name in state:
            array = state[weights.name].detach().cpu().numpy()
            weights.CopyFrom(onnx.numpy_helper.from_array(array, weights.name))
    model = onnx_ir.serde.deserialize_model(traced)
    # The optimizer numbers its nodes after those that were named while tracing.
    given = {entry.key: entry.value for entry in traced.metadata_props}[_NAMES_GIVEN]
    for _ in range(int(given)):
        _name_a_node(model.graph)
    program = torch.onnx.ONNXProgram(model, None)
    with _quiet_exporter():
        program.optimize()
    optimized: onnx.ModelProto = program.model_proto
    return optimized


def _name_a_node(graph: onnx_ir.Graph) -> int:
    """Add a node to a graph and take it away, which uses up a number; return that number."""
    node = onnx_ir.Node("", "Identity", inputs=[])
    graph.append(node)
    graph.remove(node)
    return int(str(node.name).rpartition("_")[2])


@contextmanager
def _quiet_exporter() -> Iterator[None]:
    """Without the exporter's remarks on optional packages that are not used here."""
    logger = logging.getLogger("torch.onnx")
    level = logger.level
    logger.setLevel(logging.ERROR)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.setLevel(level)
