"""The command `reojax`, and `python -m reojax`: it ends in order, from the first import on, also by Ctrl-C."""

import os
import signal
import sys
from typing import Any, NoReturn


def main() -> NoReturn:
    """Run the command line, and end the process with its status."""
    interrupted = False

    def interrupt(*_: Any) -> NoReturn:
        nonlocal interrupted
        interrupted = True
        raise KeyboardInterrupt

    def swallowed(event: Any) -> None:
        """Python drops what is raised while an object is cleared up; a Ctrl-C comes back a moment later."""
        if event.exc_type is KeyboardInterrupt:
            signal.setitimer(signal.ITIMER_REAL, 0.01)
        else:
            sys.__unraisablehook__(event)

    def told(kind: Any, *rest: Any) -> None:
        """Modules in C print what stops their import, a Ctrl-C too, before they raise."""
        if not interrupted:
            sys.__excepthook__(kind, *rest)

    sys.excepthook = told
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, interrupt)
        sys.unraisablehook = swallowed
    signal.signal(signal.SIGINT, interrupt)
    status = 130
    try:
        from reojax.cli import main as run

        status = run()
    except BaseException:  # an import that is interrupted may raise anything
        if not interrupted:
            raise
        _tell("reojax: interrupted\n")
    if status == 130:  # threads of XLA may be computing, which must not outlive Python: end them with the process
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        os._exit(130)
    sys.exit(status)


def _tell(text: str) -> None:
    if sys.stderr is not None:
        try:
            sys.stderr.write(text)
            sys.stderr.flush()
        except OSError:
            pass


if __name__ == "__main__":
    main()
