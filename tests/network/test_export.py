"""The bytes of an export: the same for equal networks, and refused where they are damaged."""

from pathlib import Path

import onnx
import pytest
from torch import nn

import pipeline
from pipeline.errors import ContentError
from pipeline.network.export import export_onnx_bytes
from pipeline.network.exported import check_onnx_bytes
from pipeline.network.ga_cnn import GaCnn


def test_equal_networks_export_equal_bytes_without_a_word_of_the_machine(
    network: GaCnn, data: bytes
) -> None:
    assert export_onnx_bytes(network, cells=24) == data
    assert str(Path(pipeline.__path__[0]).parent).encode() not in data
    assert b"ga_cnn.py" not in data


def test_an_export_is_of_convolutions_and_leaves_its_network_as_it_was(
    network: GaCnn, data: bytes
) -> None:
    operators = {node.op_type for node in onnx.load_from_string(data).graph.node}
    assert "Conv" in operators
    assert not {"Gemm", "MatMul"} & operators
    assert any(isinstance(layer, nn.Linear) for layer in network.modules())


def test_bytes_that_are_no_export_are_refused(data: bytes) -> None:
    check_onnx_bytes(data)
    for bad in (b"", b"not a network at all", data[: len(data) // 2]):
        with pytest.raises(ContentError):
            check_onnx_bytes(bad)


def test_an_operator_whose_name_is_no_text_is_refused(data: bytes) -> None:
    with pytest.raises(ContentError, match="which GA-CNN does not"):
        check_onnx_bytes(data.replace(b"Sigmoid", b"Sigmoi\xff"))
