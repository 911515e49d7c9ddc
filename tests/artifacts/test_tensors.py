"""Arrays survive the wire bit for bit; what lies about its size is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from pipeline.artifacts.tensors import DTYPES, from_tensor, tensors_of, to_tensor
from pipeline.errors import ArtifactError
from schemas.softgrip.v1.samples_pb2 import SampleBatch
from schemas.softgrip.v1.tensor_pb2 import Tensor


@given(
    st.sampled_from(DTYPES).flatmap(
        lambda d: hnp.arrays(np.dtype(d), hnp.array_shapes(max_dims=4, min_side=0))
    )
)
def test_round_trip_is_exact(array: np.ndarray) -> None:
    back = from_tensor(Tensor.FromString(to_tensor(array).SerializeToString()))
    assert back.shape == array.shape
    assert back.dtype == array.dtype
    assert back.tobytes() == array.tobytes()


def test_big_endian_and_strided_arrays_are_stored_little_endian_in_c_order() -> None:
    array = np.arange(12, dtype=">f8").reshape(3, 4).T
    np.testing.assert_array_equal(from_tensor(to_tensor(array)), array)


def test_reading_does_not_copy() -> None:
    view = from_tensor(to_tensor(np.zeros(4)))
    assert not view.flags.owndata
    assert not view.flags.writeable


@pytest.mark.parametrize(
    ("tensor", "said"),
    [
        (Tensor(dtype="O", shape=[1], data=b"12345678"), "unknown dtype 'O'"),
        (Tensor(dtype="f8", shape=[2], data=b"12345678"), "declares 16 bytes and holds 8"),
        (Tensor(dtype="u1", shape=[2**40, 2**40], data=b""), "holds 0"),
    ],
)
def test_lies_are_refused_before_anything_is_allocated(tensor: Tensor, said: str) -> None:
    with pytest.raises(ArtifactError, match=said):
        from_tensor(tensor)


def test_objects_cannot_be_stored() -> None:
    with pytest.raises(ArtifactError, match="dtype object"):
        to_tensor(np.array([{}], dtype=object))


def test_a_field_that_older_files_lack_is_filled_and_another_missing_one_is_refused() -> None:
    message = SampleBatch()
    message.quality.CopyFrom(to_tensor(np.zeros(3, dtype=np.float32)))
    stored_as, shapes = {"quality": "f4", "pictures": "u1"}, {"quality": "n", "pictures": "n"}
    arrays = tensors_of(message, stored_as, shapes, {"pictures": 1})
    np.testing.assert_array_equal(arrays["pictures"], np.ones(3, dtype=np.uint8))
    assert arrays["pictures"].dtype == np.uint8
    with pytest.raises(ArtifactError, match="unknown dtype"):
        tensors_of(message, stored_as, shapes)
    message.pictures.CopyFrom(to_tensor(np.full(2, 3, dtype=np.uint8)))
    with pytest.raises(ArtifactError, match="'pictures'"):
        tensors_of(message, stored_as, shapes, {"pictures": 1})
