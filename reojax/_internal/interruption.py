"""What a Ctrl-C at the command line leaves to say, and to remove: read by `reojax.__main__`, which ends the process."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

notes: list[str] = []
"""What to say of the work under way, if it is stopped now."""
unfinished: set[Path] = set()
"""Files that are being written, under names of their own."""


@contextmanager
def noting(note: str) -> Iterator[None]:
    """Say `note` if what runs inside is interrupted, in a program too: there it is a note of the exception."""
    notes.append(note)
    try:
        yield
    except KeyboardInterrupt as interrupt:
        interrupt.add_note(note)
        raise
    finally:
        notes.remove(note)
