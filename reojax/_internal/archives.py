"""NumPy archives (.npz) that are not believed: sizes are checked before anything is unpacked."""

import os
import zipfile
from collections.abc import Mapping
from io import BytesIO
from typing import Any

import numpy as np

from reojax._internal.files import reading


def read_archive(path: str | os.PathLike[str], most: int) -> dict[str, np.ndarray]:
    """Read all arrays of an archive that `np.savez` wrote, which packs nothing: no more bytes than the file has.

    Args:
        path: the file, of `most` bytes at most.
        most: largest size [bytes].

    Raises:
        ValueError: whatever is wrong with the file.
    """
    with reading(path, most) as raw:
        try:
            size = os.fstat(raw.fileno()).st_size
            with zipfile.ZipFile(raw) as archive:
                members = archive.infolist()
                packed = [member.filename for member in members if member.compress_type != zipfile.ZIP_STORED]
                if packed:
                    raise ValueError(f"its part {packed[0]!r} is compressed, which `np.savez` does not do")
                if sum(member.file_size for member in members) > size:
                    raise ValueError("its parts claim to be larger than the file")
                if len({member.filename for member in members}) < len(members):
                    raise ValueError("two of its parts have the same name")
                return {
                    member.filename.removesuffix(".npy"): _array(member.filename, archive.read(member))
                    for member in members
                }
        except MemoryError:
            raise ValueError("it does not fit into memory") from None
        except Exception as error:  # zipfile, struct, zlib, NumPy's header: each has errors of its own
            raise ValueError(f"it is damaged ({_one_line(error)})") from error


def check_arrays(arrays: Mapping[str, np.ndarray], expected: Mapping[str, tuple[tuple[int, ...], Any]]) -> None:
    """Refuse arrays that are missing, or of another shape or type.

    Raises:
        ValueError: naming the first one.
    """
    for name, (shape, dtype) in expected.items():
        if name not in arrays:
            raise ValueError(f"there is no array {name!r}")
        found = arrays[name]
        if found.shape != shape or found.dtype != dtype:
            raise ValueError(f"array {name!r} is {found.dtype}{list(found.shape)}, not {np.dtype(dtype)}{list(shape)}")


def _array(name: str, data: bytes) -> np.ndarray:
    """The array of an .npy file in memory, its claimed size compared with what is there."""
    file = BytesIO(data)
    version = np.lib.format.read_magic(file)
    header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}
    if version not in header:
        raise ValueError(f"part {name!r} has version {version} of the format")
    shape, _, dtype = header[version](file)
    if dtype.hasobject:
        raise ValueError(f"part {name!r} holds Python objects")
    count = 1
    for side in shape:  # of any size: Python's integers do not overflow
        count *= side
    if count * dtype.itemsize != len(data) - file.tell():
        raise ValueError(f"part {name!r} has not the size that it claims")
    return np.lib.format.read_array(BytesIO(data), allow_pickle=False)


def _one_line(error: Exception) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    return text[:200].rstrip(".")
