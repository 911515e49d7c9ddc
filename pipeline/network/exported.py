"""An exported GA-CNN as bytes: how it is marked, and the checks before it is run."""

import json
import math
from collections.abc import Iterator
from dataclasses import dataclass

import onnx
from google.protobuf.message import DecodeError

from pipeline.errors import ContentError
from pipeline.network.input_channels import KNOWN_CHANNELS, Channels

FORMAT = "softgrip.ga-cnn.onnx"
FORMAT_VERSION = 1  # rises where an older reader would misread an export
REMEDY = "Export the network again."

# All that a GA-CNN is exported to: nothing that makes large arrays of small ones.
_OPERATORS = frozenset(
    (
        *("Add", "AveragePool", "Concat", "Conv", "Gemm", "Mul", "ReduceMax", "ReduceMean"),
        *("Relu", "Sigmoid", "Squeeze", "Unsqueeze"),
    )
)
# Of one sample, between two layers: 512 channels of all cells are a seventh of it.
_MOST_VALUES = 1 << 21
_LONGEST_SHOWN = 200  # letters of a file in a message


@dataclass(frozen=True)
class ExportedInput:
    """What an exported network takes.

    Attributes
    ----------
    channels
        The channels of its input, see `pipeline.network.input_channels`.
    cells
        Cells a side of its clouds: `sensing.grid_cells` of the run that trained it.
    """

    channels: Channels
    cells: int


def check_onnx_bytes(data: bytes) -> ExportedInput:
    """Check that bytes are an export of ``export_onnx_bytes``, before anything runs them.

    Parameters
    ----------
    data
        The bytes.

    Returns
    -------
    Channels and cells of the network's input.

    Raises
    ------
    ContentError
        They are no such export, or of another version.
    """
    try:
        model = onnx.load_from_string(data)
    except DecodeError as error:
        raise ContentError(f"exported network is damaged: {error}", REMEDY) from error
    if any(weights.data_location != onnx.TensorProto.DEFAULT for weights in _weights(model)):
        raise ContentError("exported network refers to weights in other files", REMEDY)
    _check_bounded(model)
    try:
        onnx.checker.check_model(model)  # that nodes are in order: on a cycle the runtime runs away
    # Its messages may quote the bytes of a damaged model, which need not be text.
    except (onnx.checker.ValidationError, UnicodeDecodeError) as error:
        reason = str(error).partition("\n")[0]
        raise ContentError(f"exported network is damaged: {reason}", REMEDY) from error
    properties = {p.key: p.value for p in model.metadata_props}
    for channels in KNOWN_CHANNELS:
        if properties == marks_of(channels):
            sides = [d.dim_value for d in model.graph.input[0].type.tensor_type.shape.dim[1:]]
            if len(sides) != 3 or sides[0] != len(channels) or not 0 < sides[1] == sides[2]:
                raise ContentError(
                    f"exported network takes arrays of {sides}, not of {len(channels)} channels "
                    "by cells by cells",
                    REMEDY,
                )
            return ExportedInput(channels, sides[1])
    if {**properties, "channels": ""} == {**marks_of(()), "channels": ""}:
        theirs = properties.get("channels", "none")[:_LONGEST_SHOWN]
        raise ContentError(
            f"exported network takes the input channels {theirs}, and "
            f"program makes {json.dumps(KNOWN_CHANNELS[0])}",
            "Train the network again, or take one that this version trained",
        )
    raise ContentError(
        f"exported network is marked {properties}, "
        f"this program reads {marks_of(KNOWN_CHANNELS[0])}",
        REMEDY,
    )


def _weights(model: onnx.ModelProto) -> Iterator[onnx.TensorProto]:
    """Every stored tensor of a model: initial values and constants."""
    yield from model.graph.initializer
    for node in model.graph.node:
        for attribute in node.attribute:
            yield attribute.t
            yield from attribute.tensors


def _check_bounded(model: onnx.ModelProto) -> None:
    """Check that a model allocates no more than a GA-CNN does, when loaded or run.

    A runtime computes at loading what does not depend on the input, whatever its size.
    """
    graph = model.graph
    unknown = sorted({str(node.op_type) for node in graph.node} - _OPERATORS)  # may be bytes
    if unknown or model.functions or graph.sparse_initializer:
        what = ", ".join(unknown) or "functions or sparse weights"
        raise ContentError(f"exported network holds {what[:80]}, which GA-CNN does not", REMEDY)
    live = {value.name for value in graph.input} - {weights.name for weights in graph.initializer}
    for node in graph.node:
        if not live.intersection(node.input):
            raise ContentError("exported network computes what no input changes", REMEDY)
        live.update(node.output)
    try:
        inferred = onnx.shape_inference.infer_shapes(model, strict_mode=True).graph
    except onnx.shape_inference.InferenceError as error:
        reason = str(error).splitlines()[0]
        raise ContentError(f"exported network is damaged: {reason}", REMEDY) from error
    known = {value.name: value.type.tensor_type.shape for value in inferred.value_info}
    known |= {value.name: value.type.tensor_type.shape for value in inferred.output}
    batch = graph.input[0].type.tensor_type.shape.dim[0].dim_param if graph.input else ""
    for name in (name for node in graph.node for name in node.output):
        sides = list(known[name].dim) if name in known else []
        values = math.prod(int(side.dim_value) for side in sides[1:])  # 0 where one is unknown
        if not sides or sides[0].dim_param != batch or not 0 < values <= _MOST_VALUES:
            raise ContentError(
                f"exported network makes more of '{name}' than {_MOST_VALUES} values a sample",
                REMEDY,
            )


def marks_of(channels: Channels) -> dict[str, str]:
    """The properties that mark an export of a network that takes these channels."""
    return {
        "format": FORMAT,
        "version": str(FORMAT_VERSION),
        "channels": json.dumps(channels),
    }
