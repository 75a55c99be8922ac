"""Files are written whole or not at all."""

import json
import os
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO


def check_writable(path: str | os.PathLike[str]) -> Path:
    """Return `path` if a file can be written there now; for asking before a long computation.

    Raises:
        ValueError: naming the path and what stands in the way.
    """
    target = Path(path)
    with _clearly(path):
        if target.is_dir():
            raise ValueError(f"cannot write {str(path)!r}: it is a folder.")
        if target.exists() and not target.is_file():
            raise ValueError(f"cannot write {str(path)!r}: it is not a regular file.")
        if target.exists() and not os.access(target, os.W_OK):
            raise ValueError(f"cannot write {str(path)!r}: it is write-protected.")
        if not target.parent.is_dir():
            raise ValueError(f"cannot write {str(path)!r}: there is no folder {str(target.parent)!r}.")
        temporary, file = _beside(target)
        file.close()
        temporary.unlink()
    return target


def check_ending(path: str | os.PathLike[str], kind: str, formats: Sequence[str]) -> Path:
    """Return `path` if its name ends in one of `formats` and a file, a `kind`, can be written there now.

    Raises:
        ValueError: naming the path and the endings there are, or what stands in the way.
    """
    if Path(path).suffix[1:].lower() not in formats:
        endings = ", ".join(f".{ending}" for ending in formats)
        raise ValueError(f"cannot write {str(path)!r}: the name of a {kind} ends in one of {endings}.")
    return check_writable(path)


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file to write in the place of `path`, which changes only when everything has been written.

    Raises:
        ValueError: naming the path and what stands in the way.
    """
    target = check_writable(path)
    with _clearly(path):
        target = target.resolve()  # the file behind a link, so that the link stays
        temporary, file = _beside(target)
        try:
            with file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)


def write_json(path: str | os.PathLike[str], data: Any) -> None:
    """Write `data` as JSON; NumPy and JAX arrays become lists.

    Raises:
        ValueError: if a number is not finite, or the path cannot be written.
    """
    text = json.dumps(data, indent=2, allow_nan=False, default=_plain) + "\n"
    with replacing(path) as file:
        file.write(text.encode())


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} cannot be written as JSON")


def _beside(target: Path) -> tuple[Path, BinaryIO]:
    """Create a file with a name of its own in the folder of `target`."""
    temporary = target.with_name(f".reojax-{secrets.token_hex(8)}")
    return temporary, temporary.open("xb")


@contextmanager
def _clearly(path: str | os.PathLike[str]) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ValueError(f"cannot write {str(path)!r}: {error.strerror or error}.") from error
