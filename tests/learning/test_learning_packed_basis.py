"""Vertices from coefficients: the kernel against NumPy, and packing."""

import numpy as np
import pytest

from hemline.errors import BadModel
from hemline.learning.packed_basis import PackedBasis, pack_basis


def turned(random) -> np.ndarray:
    rotation = np.linalg.qr(random.normal(size=(3, 3)))[0]
    return np.concatenate([rotation, random.normal(size=(3, 1))], axis=1).astype(np.float32)


def smooth_basis(random, modes: int, vertices: int) -> np.ndarray:
    raw = np.cumsum(random.normal(size=(modes, 3 * vertices)), axis=1)
    return np.linalg.qr(raw.T)[0].T.astype(np.float32)


def vertices_by_numpy(basis, coefficients, rest, transform) -> np.ndarray:
    """What the kernel computes, in NumPy, to the last bit."""
    wanted = coefficients[basis.modes] * basis.scales
    unit = np.abs(wanted).max() / np.float32(32767) if wanted.any() else np.float32(1)
    weights = np.rint(wanted / unit).astype(np.int64)
    sums = (basis.digits.astype(np.int64) @ weights).astype(np.float32)
    x, y, z = (rest + (sums * unit).reshape(-1, 3)).T
    r = transform
    return np.stack([r[d, 0] * x + r[d, 1] * y + r[d, 2] * z + r[d, 3] for d in range(3)], axis=1)


# 1, 32 and 33 vertices: part of a block, a full one, one more; 7 columns: an odd number
@pytest.mark.parametrize(("vertices", "modes", "extra"), [(1, 3, 0), (32, 7, 0), (33, 20, 4), (500, 100, 8)])
def test_kernel_and_numpy_give_the_same_bits(vertices, modes, extra):
    random = np.random.default_rng(vertices)
    basis = random.normal(size=(modes, 3 * vertices)).astype(np.float32)
    packed = pack_basis(basis, np.ones(modes, np.float32), extra=extra)
    rest = random.normal(size=(vertices, 3)).astype(np.float32)
    for scale in (0.0, 1e-6, 1.0, 1e3):
        coefficients = (scale * random.normal(size=modes)).astype(np.float32)
        transform = turned(random)
        fast = packed.vertices(coefficients, rest, transform)
        assert fast.dtype == np.float32
        np.testing.assert_array_equal(fast, vertices_by_numpy(packed, coefficients, rest, transform))


def test_is_the_formula_up_to_sixteen_bits():
    random = np.random.default_rng(0)
    packed = pack_basis(smooth_basis(random, 30, 400), np.linspace(5, 1, 30), extra=3)
    rest, transform = random.normal(size=(400, 3)).astype(np.float32), turned(random)
    coefficients = random.normal(size=30).astype(np.float32)
    moved = (coefficients @ packed.unpack()).reshape(-1, 3)
    exact = (rest + moved) @ transform[:, :3].T + transform[:, 3]
    # each of 33 columns may be off by half a unit of 1/32767 of the largest column's reach
    reach = np.abs(coefficients[packed.modes] * packed.scales).max() * 127
    np.testing.assert_allclose(packed.vertices(coefficients, rest, transform), exact, atol=33 * reach / 65534 + 1e-5)


def test_the_largest_sum_fits_into_32_bits():
    columns = 512
    packed = PackedBasis(
        np.full((3, columns), 127, np.int8), np.ones(columns, np.float32), np.arange(columns, dtype=np.int32)
    )
    rest, transform = np.zeros((1, 3), np.float32), np.eye(3, 4, dtype=np.float32)
    found = packed.vertices(np.ones(columns, np.float32), rest, transform)
    np.testing.assert_allclose(found, 127.0 * columns, rtol=1e-6)


def test_rounding_is_half_a_step_and_second_columns_mend_it():
    random = np.random.default_rng(1)
    basis = smooth_basis(random, 6, 200)
    deviations = np.array([1, 9, 1, 1, 5, 1], np.float32)
    plain, mended = (pack_basis(basis, deviations, extra=extra) for extra in (0, 2))
    step = np.abs(basis).max(axis=1) / 127
    error = np.abs(plain.unpack() - basis).max(axis=1)
    assert (error <= 0.501 * step).all()
    assert (error > 0.3 * step).all()
    left = np.abs(mended.unpack() - basis).max(axis=1)
    np.testing.assert_array_equal(mended.modes[6:], [1, 4])
    assert (left[[1, 4]] < error[[1, 4]] / 100).all()
    np.testing.assert_array_equal(left[[0, 2, 3, 5]], error[[0, 2, 3, 5]])


def test_joined_bases_add_up():
    random = np.random.default_rng(2)
    one, two = (pack_basis(smooth_basis(random, n, 50), np.ones(n), extra=2) for n in (5, 8))
    both = one.concatenate(two)
    assert both.mode_count == 13
    np.testing.assert_array_equal(both.unpack(), np.concatenate([one.unpack(), two.unpack()]))


def test_what_is_stored_comes_back():
    packed = pack_basis(smooth_basis(np.random.default_rng(3), 5, 50), np.ones(5), extra=1)
    back = PackedBasis.of(packed.arrays(), vertex_count=50)
    for name, array in packed.arrays().items():
        np.testing.assert_array_equal(getattr(back, name), array)


@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        ({"digits": np.zeros((150, 6), np.float32)}, r"'digits' of the model must be int8 \(150, any\); got float32"),
        ({"digits": np.zeros((147, 6), np.int8)}, r"'digits'.*got int8 \(147, 6\)"),
        ({"scales": np.zeros(5, np.float32)}, r"'scales' of the model must be float32 \(6,\)"),
        ({"modes": np.array([0, 1, 2, 3, 4, 99], np.int32)}, "numbered from 0 without a gap"),
        ({"modes": np.array([0, 1, 2, 3, 4, -1], np.int32)}, "numbered from 0 without a gap"),
        ({"scales": np.full(6, np.nan, np.float32)}, "'scales' of the model must be finite"),
        ({"digits": None}, "lacks array 'digits'"),
    ],
)
def test_damaged_bases_are_refused(change, complaint):
    arrays = pack_basis(smooth_basis(np.random.default_rng(3), 5, 50), np.ones(5), extra=1).arrays() | change
    with pytest.raises(BadModel, match=complaint):
        PackedBasis.of({name: array for name, array in arrays.items() if array is not None}, vertex_count=50)


def test_absurd_numbers_of_columns_are_refused():
    for columns in (0, 513):
        arrays = {
            "digits": np.zeros((30, columns), np.int8),
            "scales": np.zeros(columns, np.float32),
            "modes": np.arange(columns, dtype=np.int32),
        }
        with pytest.raises(BadModel, match=f"1 to 512 columns; got {columns}"):
            PackedBasis.of(arrays, vertex_count=10)


def test_some_of_the_vertices_come_out_as_in_the_whole():
    random = np.random.default_rng(3)
    packed = pack_basis(smooth_basis(random, 12, 90), np.ones(12), extra=2)
    rest, transform = random.normal(size=(90, 3)).astype(np.float32), turned(random)
    coefficients, kept = random.normal(size=12).astype(np.float32), np.array([0, 3, 40, 41, 89])
    some = packed.at_vertices(kept).vertices(coefficients, rest[kept], transform)
    np.testing.assert_array_equal(some, packed.vertices(coefficients, rest, transform)[kept])
