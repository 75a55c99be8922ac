"""Programs that threads ask for at the same time."""

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

    def compile(self) -> "Traced":
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
