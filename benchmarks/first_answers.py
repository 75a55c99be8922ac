"""How long does a user wait for a first answer, without and with compiled programs kept from before?

    python benchmarks/first_answers.py                      # two minutes; --quick: one turn
    python benchmarks/first_answers.py --against FOLDER     # beside another version, unpacked there, by turns
    taskset -c 0 python benchmarks/first_answers.py --processor --turns 5   # on one core, by its time

Every command and script runs in a process of its own, start of Python included, by the clock: first with an empty cache
of compiled programs, then with what that run has left there. The least of the turns, or with `--processor` the median
of the processor time. Python's own byte code is there beforehand, as where reojax is installed. `--only TEXT ...` takes
the rows whose names contain one. Writes first_answers.json.
"""

import compileall
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from _command import chosen, comparison_options, machine, run, say, versions

from reojax.files import check_writable, write_json

_BEGIN = """
import os, jax, numpy as np
jax.config.update("jax_enable_x64", True)
jax.config.update("jax_compilation_cache_dir", os.environ["XDG_CACHE_HOME"])
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
import jax.numpy as jnp
import reojax
from reojax.robots.random import random_robot
seven = random_robot(7, 7, limits=(-1.5, 1.5))
corners = jnp.asarray(np.random.default_rng(0).uniform(-1, 1, (5, 7))).at[-1].set(0.0).at[0].set(0.0)
score = lambda corners: (reojax.net_rotation(seven, reojax.Path(corners)) * jnp.arange(9.0).reshape(3, 3)).sum()
"""
_DESIGN = """
from reojax import design
robot = {robot}
loop = design.polygons(robot, {corners})
problem = design.Problem(lambda v: (robot, loop.path(v["loop"])), [loop], objective=design.travel(loop),
                         equality=[design.turned_to(reojax.so3.exp(np.array({target})))], steps=4)
problem.solve(problem.starts(8, seed=1), max_steps=1)
"""
TASKS: dict[str, list[str]] = {
    "reojax --help": ["-m", "reojax", "--help"],
    "reojax simulate": ["-m", "reojax", "simulate"],
    "reojax time": ["-m", "reojax", "time"],
    "reojax plan --target 'rotvec 0 90 0'": ["-m", "reojax", "plan", "--target", "rotvec 0 90 0"],
    "reojax plan --vocabulary free --target 'rotvec 0 90 0'": [
        *("-m", "reojax", "plan", "--vocabulary", "free", "--target", "rotvec 0 90 0")
    ],
    "design problem of the prototype, 5 corners": [
        "-c",
        _BEGIN + _DESIGN.format(robot="reojax.robots.prototype()", corners=5, target=[0, 0, 3.1]),
    ],
    "design problem of 7 joints, 4 corners": [
        "-c",
        _BEGIN + _DESIGN.format(robot="seven", corners=4, target=[0, 0.4, 0.7]),
    ],
    "gradient of a loop of 7 joints": ["-c", _BEGIN + "jax.jit(jax.grad(score))(corners)"],
    "Hessian of a loop of 7 joints": ["-c", _BEGIN + "jax.jit(jax.hessian(score))(corners)"],
    "import jax": ["-c", "import jax"],
}
"""What runs, as arguments of Python."""


def main(out: Path, *, quick: bool, against: Path | None, only: list[str] | None, processor: bool, turns: int) -> None:
    """Measure, print and write."""
    result = check_writable(out / "first_answers.json")
    homes = versions(against)
    names = chosen(TASKS, only)
    for home in homes.values():
        compileall.compile_dir(home / "reojax", quiet=1)
    least = statistics.median if processor else min
    rows = []
    print("| first answer [s] | " + " | ".join(f"{home}, no cache | kept programs" for home in homes) + " |")
    print("|---|" + "--:|" * 2 * len(homes))
    for name in names:
        taken: dict[str, list[tuple[float, float]]] = {home: [] for home in homes}
        for _ in range(1 if quick else turns):
            for home, place in homes.items():
                with tempfile.TemporaryDirectory() as folder:
                    first, then = (_seconds(name, place, folder)[processor] for _ in range(2))
                    taken[home].append((first, then))
        told = {home: [least(times) for times in zip(*runs, strict=True)] for home, runs in taken.items()}
        print(f"| {name} | " + " | ".join(f"{seconds:.2f}" for pair in told.values() for seconds in pair) + " |")
        rows.append({"what": name, "seconds": told, "all": taken})
    write_json(result, {"machine": machine(), "processor time": processor, "rows": rows})
    say(f"wrote {result}")


def _seconds(name: str, home: Path, folder: str) -> tuple[float, float]:
    """What a process takes by the clock, and of the processor."""
    environment = {**os.environ, "PYTHONPATH": str(home), "XDG_CACHE_HOME": folder, "REOJAX_CACHE": "1"}
    environment.pop("JAX_COMPILATION_CACHE_DIR", None)
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    begin, before = time.perf_counter(), _processor_seconds()
    subprocess.run([sys.executable, *TASKS[name]], env=environment, capture_output=True, check=True, cwd=home)
    return time.perf_counter() - begin, _processor_seconds() - before


def _processor_seconds() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    parser = comparison_options(__doc__)
    parser.add_argument("--processor", action="store_true", help="medians of processor time")
    parser.add_argument("--turns", type=int, default=3, help="how often each runs [%(default)d]")
    run(main, parser)
