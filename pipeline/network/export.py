"""GA-CNN for control: ONNX bytes, and a session that runs them on the CPU."""

import json
import logging
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import onnx
import onnxruntime
import torch
from google.protobuf.message import DecodeError
from jaxtyping import Bool, Float
from onnxruntime.capi.onnxruntime_pybind11_state import (
    Fail,
    InvalidArgument,
    InvalidGraph,
    InvalidProtobuf,
    RuntimeException,
)
from onnxruntime.capi.onnxruntime_pybind11_state import (
    NotImplemented as OperatorNotImplemented,
)

from pipeline.errors import ArtifactError, ContentError
from pipeline.network.canonical import CHANNELS, network_input
from pipeline.network.ga_cnn import GaCnn
from pipeline.network.inference import predict
from pipeline.network.training import reproducible

FORMAT = "softgrip.ga-cnn.onnx"
FORMAT_VERSION = 1
# What exporting may change of a prediction: other orders of summation, no more.
LARGEST_DIFFERENCE = 1e-4

_INPUT, _OUTPUT = "inputs", "quality"
_CELLS = 24
_REMEDY = "Export the network again."
# All that a GA-CNN is exported to: nothing that makes large arrays of small ones.
_OPERATORS = frozenset(
    (
        *("Add", "AveragePool", "Concat", "Conv", "Gemm", "Mul", "ReduceMax", "ReduceMean"),
        *("Relu", "Sigmoid", "Squeeze", "Unsqueeze"),
    )
)
# Of one sample, between two layers: 512 channels of all cells are a seventh of it.
_MOST_VALUES = 1 << 21
_REFUSALS = (
    *(Fail, InvalidArgument, InvalidGraph, InvalidProtobuf),
    *(OperatorNotImplemented, RuntimeException),
)


def export_onnx_bytes(network: GaCnn) -> bytes:
    """The network as ONNX for canonical inputs of any batch; equal networks give equal bytes."""
    example = torch.zeros(2, len(CHANNELS), _CELLS, _CELLS)
    network = network.eval().to(memory_format=torch.contiguous_format)  # type: ignore[call-overload]
    with _quiet_exporter():
        program = torch.onnx.export(
            network,
            (example,),
            dynamo=True,
            dynamic_shapes=({0: torch.export.Dim("batch")},),
            input_names=[_INPUT],
            output_names=[_OUTPUT],
            verbose=False,
        )
    model = program.model_proto  # type: ignore[union-attr]
    _strip_origins(model)
    for key, value in _metadata().items():
        model.metadata_props.add(key=key, value=value)
    data: bytes = model.SerializeToString(deterministic=True)
    return data


class OnnxPredictor:
    """An exported network, loaded and ready: what control asks for quality."""

    def __init__(self, data: bytes, threads: int) -> None:
        """Load ``export_onnx_bytes``' bytes to run on ``threads`` threads of the CPU.

        Raises
        ------
        ContentError : the bytes are no such export, or of another version.
        """
        try:
            model = onnx.load_from_string(data)
        except DecodeError as error:
            raise ContentError(f"exported network is damaged: {error}", _REMEDY) from error
        if any(weights.data_location != onnx.TensorProto.DEFAULT for weights in _weights(model)):
            raise ContentError("exported network refers to weights in other files", _REMEDY)
        _check_bounded(model)
        properties = {p.key: p.value for p in model.metadata_props}
        if properties != _metadata():
            raise ContentError(
                f"exported network is marked {properties}, this program reads {_metadata()}",
                _REMEDY,
            )
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = threads
        options.inter_op_num_threads = 1
        # Threads that wait in a busy loop would take the cores from the rest of a control step.
        options.add_session_config_entry("session.intra_op.allow_spinning", "0")
        try:
            self._session = onnxruntime.InferenceSession(
                data, options, providers=["CPUExecutionProvider"]
            )
        # Its messages may quote the bytes of a damaged model, which need not be text.
        except (*_REFUSALS, RuntimeError, UnicodeDecodeError) as error:
            raise ContentError(f"exported network cannot be run: {error}", _REMEDY) from error

    def predict(
        self,
        cloud: Float[np.ndarray, "n h w 3"],
        mask: Bool[np.ndarray, "n h w"],
        batch_size: int,
    ) -> Float[np.ndarray, " n"]:
        """Predicted quality q̂ in [0, 1]; clouds and masks as for ``inference.predict``."""
        predicted = np.empty(len(cloud), dtype=np.float32)
        # One thread prepares the input: on shared cores a second one costs more than it saves.
        with reproducible(threads=1), torch.inference_mode():
            for start in range(0, len(cloud), batch_size):
                part = slice(start, start + batch_size)
                inputs = network_input(torch.from_numpy(cloud[part]), torch.from_numpy(mask[part]))
                predicted[part] = self._session.run([_OUTPUT], {_INPUT: inputs.numpy()})[0]
        return predicted


def checked_against(
    predictor: OnnxPredictor,
    network: GaCnn,
    cloud: Float[np.ndarray, "n h w 3"],
    mask: Bool[np.ndarray, "n h w"],
    batch_size: int,
    threads: int,
) -> float:
    """Largest |q̂ of the export − q̂ of the network| over sample clouds.

    Raises
    ------
    ArtifactError : it exceeds 1e-4.
    """
    exported = predictor.predict(cloud, mask, batch_size)
    expected = predict(network, cloud, mask, batch_size, threads, average_symmetries=False)
    difference = float(np.abs(exported - expected).max())
    if not difference <= LARGEST_DIFFERENCE:
        raise ArtifactError(
            f"exported network differs from its original by {difference:.2g} in quality, "
            f"more than {LARGEST_DIFFERENCE:.0e}",
            _REMEDY,
        )
    return difference


def _weights(model: onnx.ModelProto) -> Iterator[onnx.TensorProto]:
    """Every stored tensor of a model: initial values and constants."""
    yield from model.graph.initializer
    for node in model.graph.node:
        for attribute in node.attribute:
            yield attribute.t
            yield from attribute.tensors


def _check_bounded(model: onnx.ModelProto) -> None:
    """Hold what a model would allocate, loaded or run, against what a GA-CNN needs.

    A session folds what does not depend on its input when it is made, whatever it grows to.
    """
    graph = model.graph
    unknown = sorted({node.op_type for node in graph.node} - _OPERATORS)
    if unknown or model.functions or graph.sparse_initializer:
        what = ", ".join(unknown) or "functions or sparse weights"
        raise ContentError(f"exported network holds {what[:80]}, which GA-CNN does not", _REMEDY)
    live = {value.name for value in graph.input} - {weights.name for weights in graph.initializer}
    for node in graph.node:
        if not live.intersection(node.input):
            raise ContentError("exported network computes what no input changes", _REMEDY)
        live.update(node.output)
    try:
        inferred = onnx.shape_inference.infer_shapes(model, strict_mode=True).graph
    except onnx.shape_inference.InferenceError as error:
        reason = str(error).splitlines()[0]
        raise ContentError(f"exported network is damaged: {reason}", _REMEDY) from error
    known = {value.name: value.type.tensor_type.shape for value in inferred.value_info}
    known |= {value.name: value.type.tensor_type.shape for value in inferred.output}
    batch = graph.input[0].type.tensor_type.shape.dim[0].dim_param if graph.input else ""
    for name in (name for node in graph.node for name in node.output):
        sides = list(known[name].dim) if name in known else []
        values = math.prod(int(side.dim_value) for side in sides[1:])  # 0 where one is unknown
        if not sides or sides[0].dim_param != batch or not 0 < values <= _MOST_VALUES:
            raise ContentError(
                f"exported network makes more of '{name}' than {_MOST_VALUES} values a sample",
                _REMEDY,
            )


def _metadata() -> dict[str, str]:
    return {
        "format": FORMAT,
        "version": str(FORMAT_VERSION),
        "channels": json.dumps(CHANNELS),
    }


def _strip_origins(model: onnx.ModelProto) -> None:
    """Remove the traces of source files that the exporter leaves: they differ by machine."""
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
