"""The systems that `benchmarks/run.py` measures: one small file for each family.

A system is a function from the `Task` to its rows. What it needs beyond reojax it imports when it runs; if that is not
to be had, it raises `Missing` with the reason, and is left out.
"""

from collections.abc import Callable, Iterator

from . import adam, casadi_c, kernel, library, mjx, ode, per_node, plain, simulation
from ._rows import Row
from ._task import Task

SYSTEMS: dict[str, Callable[[Task], Iterator[Row]]] = {
    "reojax": library.float64,
    "reojax32": library.float32,
    "c": kernel.rows,
    "casadi": casadi_c.rows,
    "plain": plain.rows,
    "diffrax": ode.diffrax,
    "pinocchio": per_node.pinocchio,
    "mujoco": per_node.mujoco,
    "mjx": mjx.rows,
    "adam": adam.rows,
    "simulation": simulation.rows,
    "scipy": ode.scipy,
}
"""By the names that `--only` takes, in the order of the table."""
