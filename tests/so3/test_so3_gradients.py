"""Rotations: derivatives, at the points where they usually break too.

The oracles are `scipy.linalg.expm_frechet` (the derivative of the matrix exponential), closed forms, and
central differences. What holds for float64 to 1e-14 holds for float32 to 5e-6.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm_frechet

from reojax import so3

RANDOM = np.random.default_rng(0)
AXES = np.array([*np.eye(3), -np.eye(3)[1], *(a / np.linalg.norm(a) for a in RANDOM.normal(size=(3, 3)))])
# The series meet their closed forms at 1/4 (log), 1 (left_jacobian) and 2 (exp); both sides of each are here.
SEAMS = [s * (1 + side) for s in (2 * np.arctan(1 / 8), 1.0, 2.0) for side in (-1e-6, 1e-6)]
SIZES = [0.0, 1e-300, 1e-160, 1e-30, 1e-20, 1e-10, 1e-5, 1e-3, *SEAMS, 0.5, 1.7, 3.0]
SIZES += [np.pi + gap for gap in (-1e-5, -1e-8, -1e-12, 1e-12, 1e-5, 1.0, np.pi)]
VECTORS = np.array([t * a for t in SIZES for a in AXES])
HALF_TURNS = [2 * np.outer(a, a) - np.eye(3) for a in [*np.eye(3), [0.6, 0.8, 0], [0.6, 0, -0.8], AXES[-1]]]
TILTS = (1e-300, 1e-20, 1e-8, 0.1, 1.6, 3.0, np.pi - 1e-8)
EULER = np.array([[a, b, c] for a in (-2.0, 0.4) for b in TILTS for c in (-0.3, 2.9)])
QUATERNIONS = np.concatenate([np.eye(4), RANDOM.normal(size=(8, 4))])
QUATERNIONS = np.concatenate([scale * QUATERNIONS for scale in (1e-200, 1e-10, 1, 1e10)])

GENERATORS = np.array([so3.hat(e) for e in np.eye(3)])
DTYPES = pytest.mark.parametrize(("dtype", "tolerance"), [(np.float64, 1e-14), (np.float32, 5e-6)])


@functools.cache
def batched(function):
    """Return `function` over a batch, compiled once."""
    return jax.jit(jax.vmap(function))


@functools.cache
def points(function, dtype):
    """Points at which the derivative of `function` is tested, for each function the same ones every time."""
    if function in (so3.exp, so3.left_jacobian):
        return VECTORS.astype(dtype)
    if function is so3.from_quaternion:
        return QUATERNIONS[12 if dtype == np.float32 else 0 :].astype(dtype)
    if function is so3.from_euler_zxz:
        return EULER.astype(dtype)
    vectors = batched(so3.exp)(VECTORS.astype(dtype))
    tilted = batched(so3.from_euler_zxz)(EULER.astype(dtype))
    return np.concatenate([vectors, np.array(HALF_TURNS, dtype), tilted])


@functools.cache
def jacobians(function, dtype):
    """Forward and reverse Jacobian of `function` at its points, one row of the batch each."""
    forward, reverse = (jax.vmap(jac(function)) for jac in (jax.jacfwd, jax.jacrev))
    both = jax.jit(lambda x: (forward(x), reverse(x)))(points(function, dtype))
    assert both[0].dtype == both[1].dtype == dtype
    return [np.asarray(jacobian, float) for jacobian in both]


def velocity(function, dtype):
    """Angular velocity hat^-1(dR R^T), outer frame, per rate of each argument of the rotation `function`."""
    rotations = np.asarray(batched(function)(points(function, dtype)), float)
    for jacobian in jacobians(function, dtype):
        spin = np.einsum("iabk,icb->ikac", jacobian, rotations)
        yield np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], 1)


def rates(function, dtype):
    """Derivative of `function(exp(w) R)` by w at w = 0."""
    rotations = points(function, dtype).astype(float)
    for jacobian in jacobians(function, dtype):
        yield np.einsum("i...ab,kac,icb->i...k", jacobian, GENERATORS, rotations)


def close(actual, desired, tolerance):
    """Assert that two arrays agree to an absolute tolerance."""
    np.testing.assert_allclose(actual, np.broadcast_to(desired, np.shape(actual)), rtol=0, atol=tolerance)


@DTYPES
def test_exp(dtype, tolerance):
    """At zero, at tiny vectors, on both sides of the seam, and past a half turn."""
    hats = np.einsum("ik,kab->iab", points(so3.exp, dtype).astype(float), GENERATORS)
    exact = [[expm_frechet(m, g, compute_expm=False) for g in GENERATORS] for m in hats]
    for jacobian in jacobians(so3.exp, dtype):
        close(np.moveaxis(jacobian, -1, 1), exact, tolerance)


@DTYPES
def test_left_jacobian_is_the_derivative_of_exp(dtype, tolerance):
    ours = batched(so3.left_jacobian)(VECTORS.astype(dtype))
    for omega in velocity(so3.exp, dtype):
        close(ours, omega, tolerance)


def test_left_jacobian_has_a_derivative_everywhere():
    function = batched(so3.left_jacobian)
    difference = [(function(VECTORS + h) - function(VECTORS - h)) / 2e-5 for h in 1e-5 * np.eye(3)]
    for ours in jacobians(so3.left_jacobian, np.float64):
        close(np.moveaxis(ours, -1, 0), difference, 2e-10)


@DTYPES
def test_log_has_the_inverse_left_jacobian_up_to_and_at_half_turns(dtype, tolerance):
    """log(exp(w) R) = log(R) + J^-1 w to first order, `J` the left Jacobian at log(R)."""
    logs = batched(so3.log)(points(so3.log, dtype))
    forward = batched(so3.left_jacobian)(logs)
    for ours in rates(so3.log, dtype):
        close(np.einsum("iab,ibc->iac", forward, ours), np.eye(3), tolerance)


DIRECTIONS = np.array([[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [1, 0, 1]])


@jax.jit
@functools.partial(jax.vmap, in_axes=(0, None))
@functools.partial(jax.vmap, in_axes=(None, 0))
def log_of_exp(v, d):
    """Return log(exp(v)), its first and its second derivative along d."""

    def along(v):
        return jax.jvp(lambda u: so3.log(so3.exp(u)), (v,), (d,))

    (value, first), (_, second) = jax.jvp(along, (v,), (d,))
    return value, first, second


@DTYPES
def test_log_of_exp_has_the_identity_for_derivative(dtype, tolerance):
    """Past a half turn log(exp(v)) = (1 - 2 pi / t) v, t = |v|; up to it the second derivative is zero."""
    vectors = VECTORS[: -len(AXES)].astype(dtype)  # without full turns, where it jumps
    value, first, second = (np.asarray(x, float) for x in log_of_exp(vectors, DIRECTIONS.astype(dtype)))
    vectors = vectors.astype(float)
    length = np.linalg.norm(vectors, axis=1)
    turned = np.einsum("ia,ia->i", value[:, 0], vectors) < 0
    clear = abs(length - np.pi) > (1e-13 if dtype == np.float64 else 1e-6)
    assert (turned == (length > np.pi))[clear].all()
    along = vectors[turned] / length[turned, None]
    across = np.eye(3) - along[:, :, None] * along[:, None, :]
    exact = np.eye(3) - 2 * np.pi / length[turned, None, None] * across
    close(first[turned], DIRECTIONS @ exact, tolerance)
    close(first[~turned], DIRECTIONS, tolerance)
    close(second[~turned], 0, 2 * tolerance)


@DTYPES
def test_angle_rises_along_the_axis_and_is_flat_at_the_identity(dtype, tolerance):
    """Its slope is the unit axis down to the smallest angle of the dtype, 0 at 0, and of one side at pi."""
    vectors = np.asarray(batched(so3.log)(points(so3.angle, dtype)), float)
    scaled = vectors / np.where(vectors.any(1), abs(vectors).max(1), 1)[:, None]
    axis = scaled / np.where(vectors.any(1), np.linalg.norm(scaled, axis=1), 1)[:, None]
    for slope in rates(so3.angle, dtype):
        close(slope, axis, tolerance)


@DTYPES
def test_quaternion_turns_at_half_the_angular_velocity(dtype, tolerance):
    """For R -> exp(w) R: dq_0 = -u.w / 2, du = (q_0 w + w x u) / 2, whichever component is the largest."""
    q = np.asarray(batched(so3.to_quaternion)(points(so3.to_quaternion, dtype)), float)
    cross = np.einsum("ik,kab->iab", q[:, 1:], GENERATORS)
    exact = np.concatenate([-q[:, None, 1:], q[:, :1, None] * np.eye(3) - cross], 1) / 2
    for ours in rates(so3.to_quaternion, dtype):
        close(ours, exact, tolerance)


@DTYPES
def test_rotation_of_a_quaternion_does_not_feel_its_length(dtype, tolerance):
    """The angular velocity is 2 (q_0 du - u dq_0 + u x du) / |q|^2, which is zero along q."""
    q = points(so3.from_quaternion, dtype).astype(float)
    size = abs(q).max(1)[:, None]
    q = q / size
    cross = np.einsum("ik,kab->iab", q[:, 1:], GENERATORS)
    exact = np.concatenate([-q[:, 1:, None], q[:, :1, None] * np.eye(3) + cross], 2)
    exact *= 2 / (q * q).sum(1)[:, None, None]
    for omega in velocity(so3.from_quaternion, dtype):
        close(omega * size[:, None], exact, tolerance)


def euler_axes(dtype):
    """Axes the Euler angles turn about, as columns: z, the turned x, and the body's z."""
    a, b, _ = points(so3.from_euler_zxz, dtype).astype(float).T
    zero, one = np.zeros_like(a), np.ones_like(a)
    body = [np.sin(a) * np.sin(b), -np.cos(a) * np.sin(b), np.cos(b)]
    return np.transpose([[zero, zero, one], [np.cos(a), np.sin(a), zero], body], (2, 1, 0))


@DTYPES
def test_euler_rates_give_the_angular_velocity(dtype, tolerance):
    for omega in velocity(so3.from_euler_zxz, dtype):
        close(omega, euler_axes(dtype), tolerance)


@DTYPES
def test_euler_angles_of_a_rotation(dtype, tolerance):
    """The inverse of the axes. At a small tilt a and c turn at rates of 1 / tilt, and round like it."""
    tilt = EULER[:, 1].astype(dtype).astype(float)
    side = np.where(tilt < np.pi, 1.0, -1.0)  # pi - 1e-8 is more than pi in float32
    steep = np.minimum(tilt, np.pi - tilt) < 1e-6
    for ours in rates(so3.to_euler_zxz, dtype):
        product = ours[-len(EULER) :] @ euler_axes(dtype)
        assert np.isfinite(product).all()
        close(product[~steep], np.eye(3), 30 * tolerance)
        close(product[tilt > 0, 1], np.outer(side, [0, 1, 0])[tilt > 0], 30 * tolerance)


@pytest.mark.parametrize("lower", [1.0, -1.0])
def test_euler_gradient_without_a_line_of_nodes_is_the_smooth_part(lower):
    """At b = 0 and pi a turn about z shows in `a` alone (c = 0), and the rest has no derivative: 0."""
    here = (points(so3.to_euler_zxz, np.float64) == np.diag([1.0, lower, lower])).all((1, 2))
    assert here.any()
    for ours in rates(so3.to_euler_zxz, np.float64):
        close(ours[here], [[0, 0, 1], [0, 0, 0], [0, 0, 0]], 1e-14)


def test_higher_derivatives_of_exp_at_zero():
    """The k-th derivative of exp(s d) at s = 0 is hat(d)^k; Hessians by forward over reverse agree."""
    direction, weight = np.array([0.3, -0.7, 0.2]), RANDOM.normal(size=(3, 3))
    third = jax.jacfwd(jax.jacfwd(jax.jacfwd(lambda s: so3.exp(s * direction))))
    close(jax.jit(third)(0.0), np.linalg.matrix_power(so3.hat(direction), 3), 1e-15)
    products = np.einsum("iab,jbc,ac->ij", GENERATORS, GENERATORS, weight)
    hessian = jax.jit(jax.hessian(lambda v: jnp.sum(weight * so3.exp(v))))
    for tiny in (np.zeros(3), np.array([1e-300, 0, 1e-200]), np.array([0, 1e-17, 0])):
        close(hessian(tiny), (products + products.T) / 2, 1e-14)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize(
    "function",
    [
        so3.exp,
        so3.log,
        so3.angle,
        so3.to_quaternion,
        so3.from_quaternion,
        so3.to_euler_zxz,
        so3.from_euler_zxz,
    ],
    ids=lambda function: function.__name__,
)
def test_forward_is_reverse_and_nothing_is_infinite(function, dtype):
    """By every entry of the argument, at the identity, tiny turns, half turns and in between."""
    forward, reverse = jacobians(function, dtype)
    assert np.isfinite(forward).all()
    assert np.isfinite(reverse).all()
    size = np.maximum(1, abs(forward).max(tuple(range(1, forward.ndim)), keepdims=True))
    close(forward / size, reverse / size, 1e-14 if dtype == np.float64 else 5e-6)
