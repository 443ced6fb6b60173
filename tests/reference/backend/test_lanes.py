import numpy as np
import pytest

from plumbob.reference.backend import compiled
from plumbob.reference.backend.simd import vectors
from plumbob.reference.backend.simd.vectors import (
    LANES,
    load_quaternions,
    load_vectors,
    store_lanes,
    store_quaternions,
    store_vectors,
)
from plumbob.reference.quaternion import (
    add,
    conjugate,
    load_quaternion,
    load_vector,
    multiply,
    rotate,
    scale,
    store_quaternion,
    store_vector,
    subtract,
)

pytestmark = pytest.mark.both_backends

JOINTS = 3


def put_the_same(tile, scratch):
    store_quaternions(tile, 1, (1.0, 2.0, 3.0, 4.0))
    store_lanes(scratch, 1, (1.0, 2.0, 3.0, 4.0))


def algebra(a, b, v, vectors, quaternions):
    """Use every operation that lanes have, between lanes and with floats on either side."""
    p, q, x = load_quaternion(a, 0), load_quaternion(b, 0), load_vector(v, 0)
    store_quaternion(quaternions, 0, multiply(p, conjugate(q)))
    store_quaternion(quaternions, 1, multiply(p, (0.5, -0.5, 0.1, 0.7)))
    store_vector(vectors, 0, subtract(add(rotate(p, x), scale(3.0, x)), rotate(q, (0.1, 0.2, 0.3))))
    store_vector(vectors, 1, subtract((1.0, 2.0, 3.0), x))


algebra_of_tiles = compiled.bind(
    algebra,
    load_quaternion=load_quaternions,
    load_vector=load_vectors,
    store_quaternion=store_quaternions,
    store_vector=store_vectors,
)


def run(kernel, *arguments):
    return compiled.Kernel(kernel)(*arguments)


@pytest.fixture
def numbers(rng):
    """Return arrays of random numbers, contiguous and of one type, as kernels are given."""
    return lambda *shape: rng.standard_normal(shape)


def test_a_float_stands_for_itself_in_every_lane(numbers, backend):
    tile, scratch = numbers(LANES, JOINTS, 4), numbers(JOINTS, 4, LANES)
    run(put_the_same, tile, scratch)
    assert (tile[:, 1] == [1.0, 2.0, 3.0, 4.0]).all()
    assert (scratch[1].T == [1.0, 2.0, 3.0, 4.0]).all()


def test_lanes_compute_the_bits_of_floats(numbers, backend):
    a, b, v = numbers(LANES, JOINTS, 4), numbers(LANES, JOINTS, 4), numbers(LANES, JOINTS, 3)
    vectors, quaternions = np.zeros_like(v), np.zeros_like(a)
    run(algebra_of_tiles, a, b, v, vectors, quaternions)
    for i in range(LANES):
        x, q = np.zeros((JOINTS, 3)), np.zeros((JOINTS, 4))
        with compiled.set_backend("python"):
            run(algebra, a[i], b[i], v[i], x, q)
        assert (x[:2] != 0.0).all()
        assert (vectors[i] == x).all()
        assert (quaternions[i] == q).all()


def test_every_function_of_lanes_has_its_instructions():
    from plumbob.reference.backend.simd import instructions

    marked = [value for value in vars(vectors).values() if hasattr(value, "compiled_in")]
    assert len(marked) == 12
    for plain in marked:
        assert plain.compiled_in == instructions.__name__
        assert hasattr(instructions, plain.__name__)
