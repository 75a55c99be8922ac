"""CasADi: own formula as scalar expressions, its gradient by CasADi's reverse mode, as C code compiled by gcc.

Momentum gathered from the tip to the base, fourth-order Magnus method. There is one function for the steps of each
edge, so that joints at rest and angles of zero are known to it; CasADi writes the loop over the steps, and its reverse.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from math import factorial
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import jax
import numpy as np

from reojax import so3
from reojax.robots import prototype
from reojax.robots.prototype import END_INERTIA

from . import _magnus
from ._c import build, pointer
from ._measure import CORES, measure
from ._rows import GRADIENT, Row, optional, row
from ._task import WEIGHTS, Task

FLAGS = ("-O2", "-march=native")  # gcc 12 at -O3 has been seen to get such gradients wrong
CORNERS = ((0, 0, 0), (0, 1, 0), (1, 1, -1), (1, 0, -1), (0, 0, 0))
"""Of manoeuvre A, per amplitude."""


def rows(task: Task) -> Iterator[Row]:
    """Rows on one thread and on all cores."""
    ca = optional("casadi", "casadi")
    start = perf_counter()
    value, gradient = _functions(ca, task.magnus_steps)
    write = perf_counter() - start
    (call, seconds), (slope_call, slope_seconds) = _batched(ca, value), _batched(ca, gradient)
    inputs = np.ascontiguousarray(np.stack(task.loops, axis=1))
    checked = inputs[: task.checked]
    error = task.error(np.asarray(jax.vmap(so3.from_quaternion)(call(checked))))
    gradient_error = task.gradient_error(slope_call(checked)[:, 1:])
    shared: dict[str, Any] = dict(
        loops=len(inputs),
        steps=task.magnus_steps,
        evaluations=_magnus.evaluations(task.magnus_steps),
        error=error,
    )
    with ThreadPoolExecutor(CORES) as pool:
        for threads in (1, CORES)[: 1 if CORES == 1 else 2]:
            parts = np.array_split(inputs, threads)
            calls = [lambda f=f, parts=parts: list(pool.map(f, parts)) for f in (call, slope_call)]
            timed = measure(calls, task.seconds)
            shared["threads"] = threads
            yield row("CasADi to C", "value", timed[0], compile=write + seconds, **shared)
            yield row(
                "CasADi to C",
                f"{GRADIENT}, 4 variables",
                timed[1],
                gradient_error=gradient_error,
                compile=write + slope_seconds,
                value=timed[0],
                **shared,
            )


def _functions(ca: Any, steps: int) -> tuple[Any, Any]:
    """CasADi functions of (twist, bend, inertia, ratio): the quaternion; the objective with its gradient."""
    x, q = ca.MX.sym("x", 4), ca.MX(ca.DM([1, 0, 0, 0]))
    index = ca.MX(ca.DM(np.arange(steps))).T
    for edge in range(4):
        q = _step(ca, edge, steps).mapaccum(steps)(q, index, ca.repmat(x, 1, steps))[:, -1]
    number = ca.dot(ca.MX(WEIGHTS), _matrix(ca, q))
    return ca.Function("value", [x], [q]), ca.Function("gradient", [x], [ca.vertcat(number, ca.gradient(number, x))])


def _step(ca: Any, edge: int, steps: int) -> Any:
    """Step `i` of an edge: (q, i, x) to q."""
    q, i, x = ca.SX.sym("q", 4), ca.SX.sym("i"), ca.SX.sym("x", 4)
    twist, bend, inertia, ratio = ca.vertsplit(x)
    theta, rate = [ca.SX(3, 1), ca.SX(3, 1)], ca.SX(3, 1)  # sparse: what is not set is known to be zero
    for joint, (here, there) in enumerate(zip(CORNERS[edge], CORNERS[edge + 1], strict=True)):
        amplitude = bend if joint == 1 else twist
        if here != there:
            rate[joint] = (there - here) * amplitude / steps
        for at, node in zip(theta, _magnus.GAUSS, strict=True):
            if here or there:
                at[joint] = (here + (there - here) * (i + node) / steps) * amplitude
    first, second = (_omega(ca, at, rate, inertia, ratio) for at in theta)
    turn = (first + second) / 2 + 3**0.5 / 12 * _cross(ca, first, second)
    h = ca.dot(turn, turn) / 4
    c = sum((-h) ** k / factorial(2 * k) for k in range(7))
    v = turn / 2 * sum((-h) ** k / factorial(2 * k + 1) for k in range(6))
    after = ca.vertcat(q[0] * c - ca.dot(q[1:], v), q[0] * v + c * q[1:] + _cross(ca, q[1:], v))
    return ca.Function(f"step{edge}", [q, i, x], [ca.cse(after)])


def _omega(ca: Any, theta: Any, rate: Any, end_inertia: Any, ratio: Any) -> Any:
    """Angular velocity of the base, by the recursion that reojax.mechanics._fast/recursion.py explains."""
    robot, eye = prototype(), ca.SX.eye(3)
    longer = ca.sqrt(end_inertia / END_INERTIA)
    stretch = ca.diag(ca.vertcat(longer, longer, 1))
    m = [float(mass) for mass in robot.mass]
    f, J = [], []
    for k, (mass, com, inertia) in enumerate(zip(m, robot.com, robot.inertia, strict=True)):
        spread = np.trace(inertia) / 2 * np.eye(3) - inertia + mass * np.outer(com, com)
        moment, spread = _known(ca, mass * com), _known(ca, spread)
        if k in (0, 3):
            moment, spread = stretch @ moment, stretch @ spread @ stretch
        f.append(moment)
        J.append(ca.trace(spread) * eye - spread)
    p, h = [ca.SX(3, 1)] * 4, [ca.SX(3, 1)] * 4
    for k in reversed(range(3)):
        e, a, E = _known(ca, robot.axis[k]), _known(ca, robot.anchor[k]), _rotation(ca, robot.axis[k], theta[k])
        spin = (1 if robot.rotor_on[k] == "parent" else -1) * robot.rotor_inertia[k] * ratio * rate[k]
        push = E @ (p[k + 1] + rate[k] * _cross(ca, e, f[k + 1]))
        moment = E @ f[k + 1]
        g = moment + m[k + 1] * a / 2
        moved = E @ J[k + 1] @ E.T + 2 * ca.dot(a, g) * eye - a @ g.T - g @ a.T
        p[k] = p[k] + push
        h[k] = h[k] + E @ (h[k + 1] + rate[k] * (J[k + 1] @ e)) + spin * e + _cross(ca, a, push)
        J[k] = J[k] + ca.triu2symm(ca.triu(moved))
        f[k] = f[k] + moment + m[k + 1] * a
        m[k] += m[k + 1]
    A = J[0] - (ca.dot(f[0], f[0]) * eye - f[0] @ f[0].T) / m[0]
    L = h[0] - _cross(ca, f[0], p[0]) / m[0]
    xx, yy, zz, xy, xz, yz = A[0, 0], A[1, 1], A[2, 2], A[0, 1], A[0, 2], A[1, 2]
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    d, g, i = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    adjugate = ca.vertcat(ca.horzcat(a, b, c), ca.horzcat(b, d, g), ca.horzcat(c, g, i))
    return -(adjugate @ L) / (xx * a + xy * b + xz * c)


def _known(ca: Any, array: Any) -> Any:
    return ca.SX(ca.sparsify(ca.DM(np.asarray(array))))


def _cross(ca: Any, a: Any, b: Any) -> Any:
    return ca.vertcat(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def _rotation(ca: Any, axis: Any, angle: Any) -> Any:
    along = np.outer(axis, axis)
    across = ca.sparsify(ca.skew(ca.DM(axis)))
    return _known(ca, np.eye(3) - along) * ca.cos(angle) + across * ca.sin(angle) + _known(ca, along)


def _matrix(ca: Any, q: Any) -> Any:
    w, x, y, z = ca.vertsplit(q)
    return ca.vertcat(
        ca.horzcat(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        ca.horzcat(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        ca.horzcat(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def _batched(ca: Any, function: Any) -> tuple[Callable[[np.ndarray], np.ndarray], float]:
    """Turn a CasADi function into C and call it for many inputs (n, 4); and the seconds that took."""
    outputs, name = function.nnz_out(), function.name()
    loop = f"""
    void batch(int n, const double *in, double *out) {{
        const double *arg[{function.sz_arg()}];
        double *res[{function.sz_res()}], w[{function.sz_w() + 1}];
        casadi_int iw[{function.sz_iw() + 1}];
        for (int i = 0; i < n; i++) {{
            arg[0] = in + 4 * i, res[0] = out + {outputs} * i;
            {name}(arg, res, iw, w, 0);
        }}
    }}"""
    start = perf_counter()
    with TemporaryDirectory() as folder:
        generator = ca.CodeGenerator(f"{name}.c")
        generator.add(function)
        source = Path(generator.generate(folder + "/")).read_text()
    library, _ = build(source + loop, FLAGS)
    seconds = perf_counter() - start

    def call(inputs: np.ndarray) -> np.ndarray:
        out = np.empty((len(inputs), outputs))
        library.batch(len(inputs), pointer(np.ascontiguousarray(inputs)), pointer(out))
        return out

    return call, seconds
