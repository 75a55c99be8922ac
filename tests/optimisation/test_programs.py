"""The optimiser's programs: threads that ask for them at the same time, numbers that lie on another device."""

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier
from time import sleep

from reojax.optimisation.functions import _Program

WAIT = 60
"""How long the threads wait for one another before the test has failed [s]."""


class Traced:
    """What stands for a traced program: it is compiled when as many as `together` are being compiled."""

    def __init__(self, together: Barrier):
        self.together, self.times = together, 0

    def compile(self, **options) -> "Traced":
        self.times += 1
        self.together.wait(WAIT)
        sleep(0.05)  # such that others ask meanwhile
        return self


def test_two_programs_are_compiled_at_once():
    """Compiling does not hold Python's lock, and nothing else may hold one that others wait for."""
    together = Barrier(2)
    programs = [_Program(Traced(together), 0) for _ in range(2)]
    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(lambda program: program.compiled, programs)
    assert first is not second


def test_threads_that_ask_for_one_program_share_it():
    """It is compiled once, and nobody meets one whose trace has been let go."""
    traced, begun = Traced(Barrier(1)), Barrier(6)
    program = _Program(traced, 0)

    def ask(_):
        begun.wait(WAIT)
        return program.compiled

    with ThreadPoolExecutor(6) as pool:
        assert all(found is traced for found in pool.map(ask, range(6)))
    assert traced.times == 1


def test_shared_numbers_on_another_device():
    """The programs run on the default device, wherever a robot's arrays were put."""
    code = """
import jax, numpy as np
from reojax.optimisation.optimise import optimise_together
where = jax.devices()[1]
nearest = lambda x, data, shared: (((x - shared) ** 2).sum(), x[:0], x[:0])
points = np.zeros((2, 2), np.float32)
shared = jax.device_put(np.float32([0.25, 0.5]), where)
assert shared.devices() == {where}
found = optimise_together(nearest, points, lower=-1, upper=1, data=points, shared=shared, tolerance=1e-5)
np.testing.assert_allclose(found.value, np.tile(shared, (2, 1)), atol=1e-6)
"""
    environment = os.environ | {"XLA_FLAGS": "--xla_force_host_platform_device_count=2"}
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, env=environment)
