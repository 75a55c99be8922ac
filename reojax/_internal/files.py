"""Files are written whole or not at all, and read only where they are files, of a size that can be meant."""

import json
import os
import secrets
import stat
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from reojax._internal.interruption import unfinished


def check_writable(path: str | os.PathLike[str]) -> Path:
    """Return `path` if a file can be written there now; for asking before a long computation.

    Raises:
        ValueError: naming the path and what stands in the way.
    """
    target = _target(path)
    with _clearly("write", path):
        temporary, file = _beside(target, None)
        file.close()
        temporary.unlink()
    return Path(path)


def check_ending(path: str | os.PathLike[str], kind: str, formats: Sequence[str]) -> Path:
    """Return `path` if its name ends in one of `formats` and a file, a `kind`, can be written there now.

    Raises:
        ValueError: naming the path and the endings there are, or what stands in the way.
    """
    if _path("write", path).suffix[1:].lower() not in formats:
        endings = ", ".join(f".{ending}" for ending in formats)
        raise ValueError(f"cannot write {_short(path)}: the name of a {kind} ends in one of {endings}.")
    return check_writable(path)


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file to write in the place of `path`, which changes only when everything has been written.

    A file that is there keeps its permissions, and a link stays a link.

    Raises:
        ValueError: naming the path and what stands in the way.
    """
    target = _target(path)
    with _clearly("write", path):
        mode = stat.S_IMODE(target.stat().st_mode) if target.exists() else None
        temporary, file = _beside(target, mode)
        unfinished.add(temporary)
        try:
            with file:
                yield file
                file.flush()
                os.fsync(file.fileno())
            os.replace(temporary, target)
        finally:
            temporary.unlink(missing_ok=True)
            unfinished.discard(temporary)


def write_json(path: str | os.PathLike[str], data: Any) -> None:
    """Write `data` as JSON; NumPy and JAX arrays become lists.

    Raises:
        ValueError: if a number is not finite, or the path cannot be written.
    """
    text = json.dumps(data, indent=2, allow_nan=False, default=_plain) + "\n"
    with replacing(path) as file:
        file.write(text.encode())


@contextmanager
def reading(path: str | os.PathLike[str], most: int | None = None) -> Iterator[BinaryIO]:
    """Open a regular file of at most `most` bytes to read; a device, a pipe or an open descriptor is none.

    Raises:
        ValueError: naming the path and what stands in the way.
    """
    target = _path("read", path)
    with _clearly("read", path):
        # without waiting for a writer, should it be a pipe
        number = os.open(target, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        status = os.fstat(number)
        wrong = None
        if not stat.S_ISREG(status.st_mode):
            wrong = "it is a folder" if stat.S_ISDIR(status.st_mode) else "it is not a regular file"
        elif most is not None and status.st_size > most:
            wrong = f"it has {status.st_size} bytes, more than {most}"
        if wrong is not None:
            os.close(number)
            raise ValueError(f"cannot read {_short(path)}: {wrong}.")
        with os.fdopen(number, "rb") as file:
            yield file


def read_text(path: str | os.PathLike[str], most: int) -> str:
    """Read a regular text file of at most `most` bytes, in UTF-8, with or without byte order mark.

    Raises:
        ValueError: naming the path and what stands in the way.
    """
    with reading(path, most) as file:
        data = file.read(most + 1)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise ValueError(f"cannot read {_short(path)}: it is not text in UTF-8.") from None


def _plain(value: Any) -> Any:
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a {type(value).__name__} cannot be written as JSON")


def _path(what: str, path: Any) -> Path:
    """`path` as a `Path`; numbers of open files, and text that no path can be, are refused."""
    if not isinstance(path, str | os.PathLike) or not isinstance(os.fspath(path), str):
        raise ValueError(f"cannot {what} {_short(path)}: it is a {type(path).__name__}, not the path of a file.")
    if "\0" in str(path):
        raise ValueError(f"cannot {what} {_short(path)}: no path has a zero byte.")
    return Path(path)


def _target(path: Any) -> Path:
    """The file behind links that writing `path` would change, found writable as far as one can tell."""
    with _clearly("write", path):
        target = Path(os.path.realpath(_path("write", path)))
        try:
            mode = target.stat().st_mode
        except FileNotFoundError:
            if not target.parent.is_dir():
                raise ValueError(f"cannot write {_short(path)}: there is no folder {str(target.parent)!r}.") from None
            return target
        except NotADirectoryError:
            raise ValueError(f"cannot write {_short(path)}: there is no folder {str(target.parent)!r}.") from None
        if stat.S_ISDIR(mode):
            raise ValueError(f"cannot write {_short(path)}: it is a folder.")
        if not stat.S_ISREG(mode):
            raise ValueError(f"cannot write {_short(path)}: it is not a regular file.")
        if not os.access(target, os.W_OK):
            raise ValueError(f"cannot write {_short(path)}: it is write-protected.")
    return target


def _beside(target: Path, mode: int | None) -> tuple[Path, BinaryIO]:
    """Create a file with a name of its own in the folder of `target`, with permissions `mode` or the usual ones."""
    temporary = target.with_name(f".reojax-{secrets.token_hex(8)}")
    file = temporary.open("xb")
    if mode is not None:
        temporary.chmod(mode)
    return temporary, file


def _short(path: Any) -> str:
    text = repr(str(path))
    return text if len(text) <= 300 else f"{text[:150]} ... {text[-100:]}"


@contextmanager
def _clearly(what: str, path: Any) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise ValueError(f"cannot {what} {_short(path)}: {error.strerror or error}.") from error
