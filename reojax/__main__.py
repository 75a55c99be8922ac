"""The command `reojax`, and `python -m reojax`: it ends in order, from the first import on, also by Ctrl-C.

A Ctrl-C ends the process at once, with one line and status 130. Raised as an exception instead, it would go through
code of Python that JAX's compiler has called, which can end in a segmentation fault, and be swallowed where objects are
cleared up. Files are written under names of their own first, so that ending anywhere leaves nothing half done.
"""

import gc
import os
import signal
import sys
from typing import Any, NoReturn

_ALLOCATIONS = 100_000
"""Between two looks for garbage in cycles. Importing and tracing make a million objects that stay; looking through them
after every 700, as Python does, takes a sixth of the time of a short command."""


def main() -> NoReturn:
    """Run the command line, and end the process with its status."""
    signal.signal(signal.SIGINT, _end)
    gc.set_threshold(_ALLOCATIONS)
    from reojax.cli import main as run

    status = run()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # all is done and said; Python's end would take it for its default
    if status == 130:  # threads of XLA may be computing, which must not outlive Python: end them with the process
        os._exit(130)
    sys.exit(status)


def _end(*_: Any) -> NoReturn:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    work = sys.modules.get("reojax._internal.interruption")
    try:
        for file in [*getattr(work, "unfinished", ())]:
            file.unlink(missing_ok=True)
        line = "; ".join(["reojax: interrupted", *getattr(work, "notes", ())])
        below = "\n" if os.isatty(2) or getattr(work, "notes", ()) else ""  # a bar may stand there
        os.write(2, f"{below}{line}\n".encode())
    except OSError:
        pass
    os._exit(130)


if __name__ == "__main__":
    main()
