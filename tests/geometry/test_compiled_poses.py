"""Compiled products of vectors against NumPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from pipeline.geometry.compiled_poses import cross_product

vectors = arrays.arrays(float, 3, elements=st.floats(-1e6, 1e6))


@given(vectors, vectors)
def test_a_compiled_cross_product_has_the_bits_of_numpy(a: np.ndarray, b: np.ndarray) -> None:
    np.testing.assert_array_equal(cross_product(a, b), np.cross(a, b))
