"""Rotations: values. Scipy is the oracle; the rest are laws of the group."""

import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.stats
from hypothesis import given, settings, strategies as st
from scipy.spatial.transform import Rotation, Slerp

from reojax import so3

# One rotation at a time, and a batch: compiled once each, so all batches have the same length.
exp, log, angle, hat, vee = (jax.jit(f) for f in (so3.exp, so3.log, so3.angle, so3.hat, so3.vee))
to_quaternion, from_quaternion = jax.jit(so3.to_quaternion), jax.jit(so3.from_quaternion)
to_euler, from_euler = jax.jit(so3.to_euler_zxz), jax.jit(so3.from_euler_zxz)
left_jacobian = jax.jit(so3.left_jacobian)
exps, logs, angles = (jax.jit(jax.vmap(f)) for f in (so3.exp, so3.log, so3.angle))
to_quaternions, from_quaternions = (jax.jit(jax.vmap(f)) for f in (so3.to_quaternion, so3.from_quaternion))
to_eulers, from_eulers = (jax.jit(jax.vmap(f)) for f in (so3.to_euler_zxz, so3.from_euler_zxz))
interpolate = jax.jit(so3.interpolate)

RANDOM = np.random.default_rng(0)
AXES = [*np.eye(3), *-np.eye(3), *(a / np.linalg.norm(a) for a in RANDOM.normal(size=(6, 3)))]
AXES += [np.array([1.0, -1.0, 0.0]) / np.sqrt(2), np.array([1.0, 1.0, 1.0]) / np.sqrt(3)]
# The series meet their closed forms at 1/4 (log), 1 (left_jacobian) and 2 (exp); both sides of each are here.
SEAMS = [s * (1 + side) for s in (2 * np.arctan(1 / 8), 1.0, 2.0) for side in (-1e-15, 0.0, 1e-15)]
SMALL = [0.0, 1e-300, 1e-160, 1e-20, 1e-10, 1e-5, 1e-3]
NEAR_PI = [np.pi - gap for gap in (1e-2, 1e-5, 1e-8, 1e-12)]
VECTORS = np.array([t * a for t in [*SMALL, 0.1, *SEAMS, 1.5, 3.0, *NEAR_PI] for a in AXES])
ANGLES = np.linalg.norm(VECTORS / 1e-150, axis=1) * 1e-150  # scaled: the square of 1e-300 is 0
ROTATIONS = Rotation.from_rotvec(VECTORS).as_matrix()

EXAMPLES = {
    "hat": (so3.hat, (3,)),
    "vee": (so3.vee, (3, 3)),
    "exp": (so3.exp, (3,)),
    "log": (so3.log, (3, 3)),
    "angle": (so3.angle, (3, 3)),
    "left_jacobian": (so3.left_jacobian, (3,)),
    "to_quaternion": (so3.to_quaternion, (3, 3)),
    "from_quaternion": (so3.from_quaternion, (4,)),
    "to_euler_zxz": (so3.to_euler_zxz, (3, 3)),
    "from_euler_zxz": (so3.from_euler_zxz, (3,)),
}
ARGUMENT = {"hat": "vector", "vee": "matrix", "exp": "vector", "log": "rotation", "angle": "rotation"}
ARGUMENT |= {"left_jacobian": "vector", "to_quaternion": "rotation", "from_quaternion": "quaternion"}
ARGUMENT |= {"to_euler_zxz": "rotation", "from_euler_zxz": "angles"}

GAUSS = np.polynomial.legendre.leggauss(len(VECTORS))
"""As many nodes as a batch has."""

components = st.floats(-4.0, 4.0, allow_subnormal=False)
vectors = st.tuples(components, components, components).map(np.array)
laws = settings(deadline=None, derandomize=True, max_examples=60)


def example(shape, dtype=float):
    """Rotation of the given kind: an argument every function of that shape accepts."""
    value = so3.exp([0.3, -0.5, 0.7]) if shape == (3, 3) else np.linspace(0.4, 1.2, *shape)
    return jnp.asarray(value, dtype)


def close(actual, desired, tolerance=1e-14):
    """Assert that two arrays agree to an absolute tolerance."""
    np.testing.assert_allclose(actual, desired, rtol=0, atol=tolerance)


# --- against scipy ---------------------------------------------------------------------------------------


def test_exp_is_scipys():
    close(exps(VECTORS), ROTATIONS)
    far = 40 * RANDOM.normal(size=VECTORS.shape)
    close(exps(far), Rotation.from_rotvec(far).as_matrix(), 4e-14)


def test_log_is_scipys():
    close(logs(ROTATIONS), Rotation.from_matrix(ROTATIONS).as_rotvec())


def test_quaternion_is_scipys():
    ours = np.asarray(to_quaternions(ROTATIONS))
    close(ours, Rotation.from_matrix(ROTATIONS).as_quat(canonical=True, scalar_first=True))
    close(from_quaternions(ours), ROTATIONS)


def test_euler_angles_are_scipys():
    angles = RANDOM.uniform([-np.pi, 0.01, -np.pi], [np.pi, np.pi - 0.01, np.pi], size=VECTORS.shape)
    rotations = Rotation.from_euler("ZXZ", angles).as_matrix()
    close(from_eulers(angles), rotations)
    close(to_eulers(rotations), Rotation.from_matrix(rotations).as_euler("ZXZ"), 1e-13)


def test_angle_is_scipys():
    close(angles(ROTATIONS), Rotation.from_matrix(ROTATIONS).magnitude())


def test_interpolation_is_scipys():
    start, end = Rotation.random(2, random_state=np.random.default_rng(1))
    parts = np.linspace(0, 1, 7)
    ours = [interpolate(start.as_matrix(), end.as_matrix(), part) for part in parts]
    slerp = Slerp([0, 1], Rotation.concatenate([start, end]))
    close(ours, slerp(parts).as_matrix())


# --- round trips -----------------------------------------------------------------------------------------


def test_log_undoes_exp():
    close(logs(exps(VECTORS)), VECTORS, 2e-15)


def test_tiny_angles_keep_their_digits():
    rotations, tiny = exps(VECTORS), ANGLES < 0.1
    np.testing.assert_allclose(logs(rotations)[tiny], VECTORS[tiny], rtol=1e-15, atol=0)
    np.testing.assert_allclose(angles(rotations)[tiny], ANGLES[tiny], rtol=1e-15, atol=0)


def test_angle_is_the_length_of_the_rotation_vector():
    close(angles(exps(VECTORS)), ANGLES, 2e-15)


@laws
@given(st.tuples(components, components, components, components).map(np.array).filter(np.any))
def test_quaternion_round_trip(q):
    rotation = from_quaternion(q)
    back = to_quaternion(rotation)
    assert back[0] >= 0
    unit = q / abs(q).max()
    close(abs(back @ unit), np.linalg.norm(unit))
    close(from_quaternion(back), rotation)


def test_quaternion_of_any_length_is_normalised():
    q = np.array([0.5, -0.5, 0.1, 0.7])
    for scale in (1e-300, 1e-160, 1e-5, -1.0, 1e5, 1e160, 1e300):
        close(from_quaternion(scale * q), from_quaternion(q))
    close(from_quaternion(np.array([np.finfo(float).tiny, 0, 0, 0])), np.eye(3))  # the smallest normal number


@laws
@given(vectors)
def test_euler_round_trip(v):
    rotation = exp(v)
    a, b, c = to_euler(rotation)
    assert -np.pi < a <= np.pi
    assert 0 <= b <= np.pi
    assert -np.pi < c <= np.pi
    close(from_euler(jnp.stack([a, b, c])), rotation)


def test_euler_angles_are_about_turned_axes():
    """R = Rz(a) Rx(b) Rz(c), whose third column is where the body's z axis points."""
    a, b, c = 0.4, 1.1, -2.0
    x, z = np.eye(3)[0], np.eye(3)[2]
    rotation = from_euler(np.array([a, b, c]))
    close(rotation, exp(a * z) @ exp(b * x) @ exp(c * z))
    close(rotation[:, 2], [np.sin(a) * np.sin(b), -np.cos(a) * np.sin(b), np.cos(b)])


@pytest.mark.parametrize("b", [1e-300, 1e-20, 1e-8, 1e-3])
def test_euler_angles_of_a_small_tilt_keep_their_digits(b):
    back = np.asarray(to_euler(from_euler(np.array([0.3, b, 2.0]))))
    close(back, [0.3, b, 2.0], 2e-15)
    np.testing.assert_allclose(back[1], b, rtol=1e-15)


@pytest.mark.parametrize("turn", [0.0, 1e-200, 0.7, -2.5, np.pi])
def test_euler_angles_without_a_line_of_nodes_have_c_zero(turn):
    upright = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    a, b, c = to_euler(upright)
    close(a, turn)
    assert (b, c) == (0, 0)
    a, b, c = to_euler(upright @ np.diag([1.0, -1.0, -1.0]))
    close(a, turn)
    close(b, np.pi)
    assert c == 0


# --- half turns ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", AXES)
def test_half_turn(axis):
    """Of the two rotation vectors of a half turn, the one whose largest component is positive is given."""
    rotation = 2 * np.outer(axis, axis) - np.eye(3)
    q, v = np.asarray(to_quaternion(rotation)), np.asarray(log(rotation))
    assert q[0] == 0
    assert q[1:][np.argmax(abs(q[1:]))] > 0
    close(angle(rotation), np.pi, 1e-15)
    close(v, np.pi * q[1:])
    close(abs(v @ axis), np.pi)
    close(exp(v), rotation)
    close(from_euler(to_euler(rotation)), rotation)


def test_sign_is_continuous_up_to_a_half_turn():
    for axis in AXES:
        before = np.asarray(log(exp((np.pi - 1e-9) * axis)))
        close(before, (np.pi - 1e-9) * axis)
        after = np.asarray(log(exp((np.pi + 1e-9) * axis)))
        close(after, (1e-9 - np.pi) * axis)


# --- group laws ------------------------------------------------------------------------------------------


@laws
@given(vectors, vectors)
def test_rotations_are_a_group_and_the_angle_is_a_distance(v, w):
    p, q = exp(v), exp(w)
    close(p @ p.T, np.eye(3))
    close(np.linalg.det(p), 1)
    close(exp(-v), p.T)
    close(angle(p.T @ q), angle(q.T @ p))
    close(angle(p @ q @ p.T), angle(q), 2e-14)
    assert angle(p @ q) <= angle(p) + angle(q) + 1e-14


@laws
@given(vectors, st.floats(-3, 3), st.floats(-3, 3))
def test_turns_about_one_axis_add(v, s, t):
    close(exp(s * v) @ exp(t * v), exp((s + t) * v), 3e-14)


@laws
@given(vectors, vectors)
def test_hat_is_the_cross_product_and_turns_with_the_vector(v, w):
    close(hat(v) @ w, np.cross(v, w))
    close(exp(w) @ hat(v) @ exp(w).T, hat(exp(w) @ v), 4e-14)
    assert (vee(hat(v)) == v).all()


def test_vee_takes_the_skew_part():
    m = RANDOM.normal(size=(3, 3))
    close(hat(vee(m)), (m - m.T) / 2)
    assert (vee(m + m.T) == 0).all()


@laws
@given(vectors)
def test_left_jacobian_is_the_mean_of_the_rotations_on_the_way(v):
    """J(v) is the integral of exp(s v) for s from 0 to 1 (Gauss quadrature), and exp(v) - I = hat(v) J(v)."""
    nodes, weights = GAUSS
    mean = np.einsum("i,iab->ab", weights / 2, exps((nodes[:, None] + 1) / 2 * v))
    close(left_jacobian(v), mean, 1e-13)
    close(hat(v) @ left_jacobian(v), exp(v) - np.eye(3), 3e-14)
    close(left_jacobian(-v), left_jacobian(v).T)


def test_interpolation_turns_at_a_constant_rate():
    p, q = exp(np.array([0.3, -1.0, 0.5])), exp(np.array([1.0, 0.2, -2.0]))
    close(interpolate(p, q, 0.0), p)
    close(interpolate(p, q, 1.0), q)
    for part in (0.25, 0.5, 0.75):
        close(angle(p.T @ interpolate(p, q, part)), part * angle(p.T @ q))


def test_random_rotations_are_uniform():
    """Angles of the Haar distribution have density (1 - cos t) / pi, axes are uniform on the sphere."""
    draw = jax.jit(jax.vmap(so3.random))
    vector = np.asarray(logs(draw(jax.random.split(jax.random.key(0), len(VECTORS)))))
    turn = np.linalg.norm(vector, axis=1)
    assert scipy.stats.kstest(turn, lambda t: (t - np.sin(t)) / np.pi).pvalue > 0.01
    for k in range(3):
        assert scipy.stats.kstest(vector[:, k] / turn, scipy.stats.uniform(-1, 2).cdf).pvalue > 0.01
    assert jax.eval_shape(lambda key: so3.random(key, jnp.float32), jax.random.key(0)).dtype == jnp.float32


# --- arrays: dtype, shape, batching, what it compiles to -------------------------------------------------


def test_float32_is_right_to_its_own_rounding():
    """Down to 1e-30 rad: what is smaller has the identity for rotation."""
    stretch = np.clip(ANGLES, 1e-30, None) / np.where(ANGLES == 0, 1, ANGLES)
    vectors = (stretch[:, None] * VECTORS).astype(np.float32)
    length = np.linalg.norm(vectors.astype(float), axis=1)
    rotations = exps(vectors)
    assert rotations.dtype == np.float32
    close(rotations, Rotation.from_rotvec(vectors.astype(float)).as_matrix(), 6e-7)
    below = length < 3.1
    close(logs(rotations)[below], vectors[below], 6e-7)
    close(from_quaternions(to_quaternions(rotations)), rotations, 6e-7)
    close(from_eulers(to_eulers(rotations)), rotations, 1e-6)
    tiny = length < 0.1
    np.testing.assert_allclose(logs(rotations)[tiny], vectors[tiny], rtol=1e-6, atol=0)
    np.testing.assert_allclose(angles(rotations)[tiny], length[tiny], rtol=1e-6, atol=0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
@pytest.mark.parametrize("name", EXAMPLES)
def test_dtype_is_kept(name, dtype):
    function, shape = EXAMPLES[name]
    argument = jax.ShapeDtypeStruct(shape, dtype)
    with jax.numpy_dtype_promotion("strict"):
        value, slope = jax.eval_shape(jax.value_and_grad(lambda x: function(x).sum()), argument)
    assert value.dtype == slope.dtype == dtype


def test_lists_and_integers_become_the_default_float():
    for value in ([0, 0, 1], [0.0, 0.0, 1.0], np.array([0, 0, 1]), [jnp.float64(0), 0, 1]):
        assert (so3.hat(value) == so3.hat([0.0, 0.0, 1.0])).all()
        assert so3.hat(value).dtype == np.float64
    close(so3.vee([[0, -3, 2], [3, 0, -1], [-2, 1, 0]]), [1, 2, 3])
    with jax.enable_x64(False):
        assert so3.hat([0, 0, 1]).dtype == np.float32


@pytest.mark.parametrize("name", EXAMPLES)
def test_vmap_is_the_loop(name):
    function, shape = EXAMPLES[name]
    one = example(shape)
    batch = jnp.stack([one, one.T, -one if shape != (3, 3) else one @ one])
    single = jax.jit(function)
    close(jax.jit(jax.vmap(function))(batch), [single(x) for x in batch], 1e-15)


@pytest.mark.parametrize("name", EXAMPLES)
def test_no_linear_algebra_library_is_called(name):
    """Batched LAPACK may deadlock, and float32 matrix products lose digits on accelerators."""
    function, shape = EXAMPLES[name]
    argument = example(shape)
    slope = jax.value_and_grad(lambda x: jnp.sum(function(x) ** 2))
    text = jax.jit(slope).lower(argument).compile().as_text()
    assert text
    assert re.findall(r"lapack_\w+", text) == []
    assert "dot_general" not in str(jax.make_jaxpr(slope)(argument))


@pytest.mark.parametrize("name", EXAMPLES)
@pytest.mark.parametrize("shape", [(), (2,), (3, 1), (2, 3), (1, 3, 3)])
def test_wrong_shape_is_named(name, shape):
    function, right = EXAMPLES[name]
    message = re.escape(f"`{ARGUMENT[name]}` has shape {shape}; it must be {right}.")
    with pytest.raises(ValueError, match=message):
        function(np.zeros(shape))
    with pytest.raises(ValueError, match=message):
        jax.eval_shape(function, jax.ShapeDtypeStruct(shape, np.float32))


def test_interpolate_names_its_arguments():
    one = np.eye(3)
    wrong = {"start": (one[0], one, 0), "end": (one, one[0], 0), "fraction": (one, one, [0])}
    for name, arguments in wrong.items():
        with pytest.raises(ValueError, match=f"`{name}` has shape"):
            so3.interpolate(*arguments)


@pytest.mark.parametrize("value", [[[1, 2], [3]], [None, 0, 0], [1j, 0, 0]])
def test_what_is_no_real_array_is_refused(value):
    with pytest.raises(ValueError, match="`vector`"):
        so3.exp(value)
