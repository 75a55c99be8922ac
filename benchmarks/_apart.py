"""Work in a process of its own, bounded in time and memory: a compiler may run away, and must not take the machine."""

import multiprocessing
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any

from _command import settings


def apart(function: Callable[..., Iterator[Any]], *arguments: Any, patience: float, memory: float) -> Iterator[Any]:
    """Run the generator `function` in a process of its own and yield what it yields.

    Args:
        function: a generator function at the top of a module.
        arguments: its arguments.
        patience: seconds to wait for each thing.
        memory: bytes of address space, where the system can bound it.

    Raises:
        TimeoutError: if one took longer.
        MemoryError: if the process died, most likely of the bound.
    """
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe(duplex=False)
    process = context.Process(target=_work, args=(there, memory, function, arguments), daemon=True)
    process.start()
    there.close()
    try:
        while True:
            if not here.poll(patience):
                raise TimeoutError(f"nothing came for {patience:g} s")
            try:
                yield here.recv()
            except EOFError:
                break
        process.join()
        if process.exitcode:
            raise MemoryError(f"the process ended with {process.exitcode}, allowed {memory / 2**30:g} GiB")
    finally:
        process.kill()
        process.join()


def _work(there: Connection, memory: float, function: Callable[..., Iterator[Any]], arguments: tuple) -> None:
    try:
        import resource
    except ImportError:  # not on this system
        pass
    else:
        resource.setrlimit(resource.RLIMIT_AS, (int(memory), int(memory)))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    settings()
    for result in function(*arguments):
        there.send(result)
