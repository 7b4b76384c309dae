"""Rotations against scipy and roma, by their own laws, and with gradients that are finite everywhere."""

from __future__ import annotations

import importlib
import itertools
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation, Slerp

from retarget_bench.errors import BenchError
from retarget_bench.motion import rotation
from tests.examples import examples

ORDERS = ["".join(o) for o in itertools.product("XYZ", repeat=3) if o[0] != o[1] and o[1] != o[2]]
IDENTITY = (1.0, 0.0, 0.0, 0.0)
HALF_TURNS = [(0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.6, 0.0, -0.8), (-0.0, 0.0, 0.0, -1.0)]

numbers = st.floats(-1, 1, width=64)
# hypothesis shrinks to and samples at the ends: tiny angles, and angles close to a half turn
magnitudes = st.one_of(
    st.floats(0, np.pi), st.floats(0, 1e-7), st.floats(0, 1e-7).map(lambda small: np.pi - small)
)
directions = arrays(np.float64, 3, elements=numbers).filter(lambda v: np.linalg.norm(v) > 1e-3)


def scipy(q: np.ndarray) -> Rotation:
    return Rotation.from_quat(q, scalar_first=True)


def random_quaternions(count: int, seed: int = 0) -> np.ndarray:
    return Rotation.random(count, rng=np.random.default_rng(seed)).as_quat(scalar_first=True)


def same_rotation(a: np.ndarray, b: np.ndarray, tolerance: float = 1e-12) -> bool:
    return bool((scipy(a).inv() * scipy(b)).magnitude().max() <= tolerance)


def unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


@pytest.fixture
def roma() -> Any:
    """Imported late: it brings torch's compiler, seconds of all processes that collect tests."""
    return importlib.import_module("roma")


def test_products_and_conversions_agree_with_scipy() -> None:
    a, b = random_quaternions(200, 1), random_quaternions(200, 2)
    v = np.random.default_rng(3).normal(size=(200, 3))
    assert same_rotation(rotation.multiply(a, b), (scipy(a) * scipy(b)).as_quat(scalar_first=True))
    assert same_rotation(rotation.conjugate(a), scipy(a).inv().as_quat(scalar_first=True))
    np.testing.assert_allclose(rotation.rotate(a, v), scipy(a).apply(v), atol=1e-14)
    np.testing.assert_allclose(rotation.to_matrix(a), scipy(a).as_matrix(), atol=1e-14)
    np.testing.assert_allclose(rotation.to_rotation_vector(a), scipy(a).as_rotvec(), atol=1e-14)
    for turned in (a, np.array([IDENTITY, *HALF_TURNS])):
        assert same_rotation(rotation.from_matrix(scipy(turned).as_matrix()), turned)
    turned = Rotation.from_rotvec(3 * v).as_quat(scalar_first=True)
    assert same_rotation(rotation.from_rotation_vector(3 * v), turned)
    np.testing.assert_allclose(rotation.angle(a, b), (scipy(a).inv() * scipy(b)).magnitude(), atol=1e-14)


@pytest.mark.parametrize("order", ORDERS)
def test_euler_angles_agree_with_scipy(order: str) -> None:
    angles = np.random.default_rng(4).uniform(-7, 7, size=(200, 3))
    turned = Rotation.from_euler(order, angles).as_quat(scalar_first=True)
    assert same_rotation(rotation.from_euler(angles, order), turned)
    np.testing.assert_allclose(rotation.to_euler(turned, order), scipy(turned).as_euler(order), atol=1e-12)


def test_slerp_agrees_with_scipy() -> None:
    keys = random_quaternions(2, 5)
    shares = np.linspace(0, 1, 11)
    expected = Slerp([0, 1], scipy(keys))(shares).as_quat(scalar_first=True)
    a, b = np.tile(keys[0], (11, 1)), np.tile(keys[1], (11, 1))
    assert same_rotation(rotation.slerp(a, b, shares), expected)
    assert same_rotation(rotation.slerp(a, -b, shares), expected), "the shorter way, whatever the signs"


def test_tensors_agree_with_roma(roma: Any) -> None:
    a, b = (torch.tensor(random_quaternions(200, seed)) for seed in (6, 7))
    last = [1, 2, 3, 0]  # roma has w last
    product = roma.quat_product(a[:, last], b[:, last])
    torch.testing.assert_close(rotation.multiply(a, b)[:, last], product)
    torch.testing.assert_close(rotation.to_matrix(a), roma.unitquat_to_rotmat(a[:, last]))
    torch.testing.assert_close(rotation.to_rotation_vector(a), roma.unitquat_to_rotvec(a[:, last]))
    distance = roma.rotmat_geodesic_distance(rotation.to_matrix(a), rotation.to_matrix(b))
    torch.testing.assert_close(rotation.angle(a, b), distance)
    middle = roma.unitquat_slerp(a[:, last], b[:, last], torch.tensor([0.3], dtype=a.dtype))[0]
    assert rotation.angle(rotation.slerp(a, b, 0.3)[:, last], middle).max() < 1e-12


def test_gradients_agree_with_roma(roma: Any) -> None:
    v = torch.tensor(np.random.default_rng(8).normal(size=(50, 3)), requires_grad=True)
    weights = torch.tensor(np.random.default_rng(9).normal(size=(50, 3, 3)))
    own = rotation.to_matrix(rotation.from_rotation_vector(v))
    reference = roma.rotvec_to_rotmat(v)
    (a,) = torch.autograd.grad((own * weights).sum(), v)
    (b,) = torch.autograd.grad((reference * weights).sum(), v)
    torch.testing.assert_close(a, b)


@given(axis=directions, magnitude=magnitudes)
def test_rotation_vectors_keep_tiny_and_half_turns(axis: np.ndarray, magnitude: float) -> None:
    vector = unit(axis) * magnitude
    back = rotation.to_rotation_vector(rotation.from_rotation_vector(vector))
    if np.pi - magnitude < 1e-12:  # both ways round are the same half turn
        back = back * np.sign(back @ vector)
    np.testing.assert_allclose(back, vector, rtol=1e-9, atol=1e-15)
    angle = rotation.angle(rotation.identity(), rotation.about(axis, magnitude))
    assert angle == pytest.approx(magnitude, rel=1e-9, abs=1e-15)


@examples(100)
@given(
    first=st.floats(-np.pi, np.pi),
    last=st.floats(-np.pi, np.pi),
    off=st.one_of(st.floats(-1e-3, 1e-3), st.sampled_from([0.0, 1e-17, 1e-12, -1e-9, 1e-8, -1e-6])),
    pole=st.sampled_from([-1, 1]),
    order=st.sampled_from(ORDERS),
)
def test_euler_angles_near_gimbal_lock(
    first: float, last: float, off: float, pole: int, order: str
) -> None:
    repeats = order[0] == order[2]
    middle = off + (np.pi * (pole > 0) if repeats else pole * np.pi / 2)
    q = Rotation.from_euler(order, [first, middle, last]).as_quat(scalar_first=True)
    angles = rotation.to_euler(q, order)
    again = Rotation.from_euler(order, angles).as_quat(scalar_first=True)
    assert same_rotation(again, q, 1e-9)
    low, high = (0, np.pi) if repeats else (-np.pi / 2, np.pi / 2)
    assert low - 1e-12 <= angles[1] <= high + 1e-12
    assert np.abs(angles[[0, 2]]).max() <= np.pi + 1e-12


@given(u=directions, v=directions, flip=st.floats(0, 1e-6))
def test_between_is_the_shortest_turn(u: np.ndarray, v: np.ndarray, flip: float) -> None:
    for target in (v, u, -u, -2 * u + flip * v):
        if np.linalg.norm(target) < 1e-9:
            continue
        q = rotation.between(u, target)
        np.testing.assert_allclose(scipy(q).apply(unit(u)), unit(target), atol=1e-12)
        straight = np.arctan2(np.linalg.norm(np.cross(unit(u), unit(target))), unit(u) @ unit(target))
        assert scipy(q).magnitude() == pytest.approx(straight, abs=1e-7)


def test_continuous_only_changes_signs_and_leaves_no_jump() -> None:
    steps = np.cumsum(np.random.default_rng(10).normal(size=(100, 5, 3)) * 0.1, axis=0)
    smooth = rotation.from_rotation_vector(steps)
    signs = np.random.default_rng(11).choice([-1.0, 1.0], size=(100, 5, 1))
    fixed = rotation.continuous(smooth * signs)
    assert ((fixed[1:] * fixed[:-1]).sum(-1) > 0).all()
    np.testing.assert_allclose(np.abs(fixed), np.abs(smooth))
    np.testing.assert_array_equal(fixed[0], (smooth * signs)[0])
    turned = rotation.continuous((smooth * signs).swapaxes(0, 1), axis=1)
    np.testing.assert_array_equal(turned, fixed.swapaxes(0, 1))
    np.testing.assert_array_equal(rotation.continuous(torch.tensor(smooth * signs)).numpy(), fixed)


def test_vectors_without_direction_give_the_identity() -> None:
    zero, up = np.zeros(3), np.array([0.0, 1.0, 0.0])
    for q in (
        rotation.normalise(np.zeros(4)),
        rotation.between(zero, up),
        rotation.between(up, zero),
        rotation.between(zero, zero),
        rotation.about(zero, 1.0),
    ):
        np.testing.assert_allclose(q, IDENTITY, atol=1e-15)


def test_leading_axes_broadcast() -> None:
    a, b = random_quaternions(6, 12).reshape(2, 3, 4), random_quaternions(3, 13)
    assert rotation.multiply(a[:, :1], b).shape == (2, 3, 4)
    np.testing.assert_allclose(rotation.multiply(a, b)[1, 2], rotation.multiply(a[1, 2], b[2]))
    np.testing.assert_allclose(rotation.rotate(b, np.eye(3)[:, None])[0, 2], scipy(b[2]).apply([1, 0, 0]))
    assert rotation.slerp(a, b, np.full((2, 1), 0.5)).shape == (2, 3, 4)
    assert rotation.multiply(np.asfortranarray(a), b[::-1]).shape == (2, 3, 4)
    assert rotation.identity(2, 3).shape == (2, 3, 4)


@pytest.mark.parametrize("order", ["XY", "XXY", "XYY", "ABC", "", "XYZX"])
def test_impossible_orders_are_refused(order: str) -> None:
    with pytest.raises(BenchError, match="three of X, Y, Z"):
        rotation.to_euler(np.array(IDENTITY), order)


def cases() -> dict[str, tuple]:
    """Every function with inputs that include its special points, ``(n, ...)`` each."""
    tiny = (1.0, 1e-21, 1e-21, 0.0)  # its square is not a normal number in single precision
    special = np.array([IDENTITY, tuple(-x for x in IDENTITY), *HALF_TURNS, tiny])
    q = np.concatenate([special, random_quaternions(4, 14), rotation.from_euler(_locked(), "ZXY")])
    n = len(q)
    generator = np.random.default_rng(15)
    v = generator.normal(size=(n, 3))
    v[:4] = np.zeros(3), (1e-9, 0, 0), (0, np.pi, 0), (0, 0, 2 * np.pi)
    u = generator.normal(size=(n, 3))
    u[:6] = [*np.eye(3), (0, -np.pi, 0), (0, 0, 5), (0, 0, 0)]
    same = q * np.where(np.arange(n) % 2, 1, -1)[:, None]
    halves = rotation.multiply(q, np.broadcast_to(HALF_TURNS[2], (n, 4)))
    operations = {
        "conjugate": (rotation.conjugate, q),
        "normalise": (rotation.normalise, q * np.arange(n)[:, None]),
        "to_rotation_vector": (rotation.to_rotation_vector, q),
        "from_rotation_vector": (rotation.from_rotation_vector, v),
        "to_matrix": (rotation.to_matrix, q),
        "from_matrix": (rotation.from_matrix, scipy(q).as_matrix()),
        "rotate": (rotation.rotate, q, v),
        "multiply": (rotation.multiply, q, halves),
        "angle": (rotation.angle, q, q[::-1].copy()),
        "angle_same": (rotation.angle, q, same),
        "angle_half": (rotation.angle, q, halves),
        "slerp": (lambda a, b: rotation.slerp(a, b, 0.25), q, q[::-1].copy()),
        "slerp_same": (lambda a, b: rotation.slerp(a, b, 0.25), q, same),
        "slerp_half": (lambda a, b: rotation.slerp(a, b, 0.25), q, halves),
        "between": (rotation.between, u, v),
        "between_same": (rotation.between, u, 2 * u),
        "between_opposite": (rotation.between, u, -2 * u),
        "about": (lambda a, t: rotation.about(a, t[:, 0]), v, u),
        "continuous": (rotation.continuous, q),
    }
    orders = ("ZXY", "XYZ", "ZXZ", "YXY")
    operations |= {f"to_euler_{o}": (lambda q, o=o: rotation.to_euler(q, o), q) for o in orders}
    return operations | {f"from_euler_{o}": (lambda a, o=o: rotation.from_euler(a, o), v) for o in orders}


def _locked() -> np.ndarray:
    """Euler angles ZXY at gimbal lock."""
    return np.array([(0.3, np.pi / 2, 0.4), (-1.0, -np.pi / 2, 2.0), (0.0, np.pi / 2, 0.0)])


CASES = cases()


@pytest.mark.parametrize("name", CASES)
def test_tensors_give_the_numbers_of_arrays(name: str) -> None:
    function, *inputs = CASES[name]
    expected = function(*inputs)
    actual = function(*(torch.tensor(each) for each in inputs)).numpy()
    if name == "slerp_half":  # two shortest ways, and the last bit decides which is taken
        actual, expected = (rotation.angle(each, inputs[0]) for each in (actual, expected))
    if name.startswith("to_euler"):  # at gimbal lock the last bit decides which angles are returned
        order = name[-3:]
        actual, expected = (Rotation.from_euler(order, each).as_matrix() for each in (actual, expected))
    np.testing.assert_allclose(actual, expected, atol=1e-9)
    assert np.isfinite(expected).all()


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
@pytest.mark.parametrize("name", CASES)
def test_gradients_are_finite_everywhere(name: str, dtype: torch.dtype) -> None:
    function, *inputs = CASES[name]
    leaves = [torch.tensor(each, dtype=dtype, requires_grad=True) for each in inputs]
    out = function(*leaves)
    weights = torch.tensor(np.random.default_rng(16).normal(size=tuple(out.shape)), dtype=dtype)
    (out * weights).sum().backward()
    for leaf in leaves:
        bad = ~torch.isfinite(leaf.grad).flatten(1).all(1)
        assert not bad.any(), f"gradient {leaf.grad[bad][0]} at {leaf[bad][0]}"


SMOOTH = ["conjugate", "multiply", "rotate", "to_matrix", "from_rotation_vector", "from_euler_ZXZ"]


@pytest.mark.parametrize("name", SMOOTH)
def test_gradients_are_right_at_special_points(name: str) -> None:
    function, *inputs = CASES[name]
    assert torch.autograd.gradcheck(function, [torch.tensor(each, requires_grad=True) for each in inputs])


@pytest.mark.parametrize("start", [IDENTITY, *HALF_TURNS])
@pytest.mark.parametrize("name", ["to_rotation_vector", "from_matrix", "slerp", "to_euler", "angle"])
def test_gradients_are_right_along_the_sphere(name: str, start: tuple[float, ...]) -> None:
    """At the identity and close to half turns (beyond which these functions jump), by differences."""
    functions = {
        "to_rotation_vector": rotation.to_rotation_vector,
        "from_matrix": lambda q: rotation.from_matrix(rotation.to_matrix(q)),
        "slerp": lambda q: rotation.slerp(torch.tensor(IDENTITY, dtype=q.dtype), q, 0.3),
        "to_euler": lambda q: rotation.to_euler(q, "ZXY"),
        "angle": lambda q: rotation.angle(torch.tensor((0.8, 0.0, 0.6, 0.0), dtype=q.dtype), q),
    }
    base = rotation.multiply(np.array(start), rotation.from_rotation_vector(np.array([-0.03, 0.05, -0.04])))
    if start == IDENTITY:
        base = np.array(IDENTITY)
    fixed = torch.tensor(base)

    def at(turn: torch.Tensor) -> torch.Tensor:
        return functions[name](rotation.multiply(fixed, rotation.from_rotation_vector(turn)))

    assert torch.autograd.gradcheck(at, torch.zeros(3, dtype=torch.float64, requires_grad=True))


def test_arrays_need_no_torch() -> None:
    code = (
        "import sys, numpy as np; from retarget_bench.motion import rotation as r; "
        "r.slerp(r.identity(2), r.from_euler(np.ones((2, 3)), 'ZXY'), .5); "
        "sys.exit('torch' in sys.modules or 'scipy' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_blocks_of_long_arrays_do_not_show() -> None:
    for count in (0, 1, 1024, 3000):
        a, b = random_quaternions(max(count, 1), 1)[:count], random_quaternions(max(count, 1), 2)[:count]
        np.testing.assert_array_equal(rotation.in_blocks(rotation.multiply, a, b), rotation.multiply(a, b))
