"""Pictures in files: which kinds there are, and writing them whole or not at all."""

import os
from pathlib import Path

from matplotlib.figure import Figure

from reojax._internal.files import check_ending, replacing
from reojax.plot._arguments import check_arguments

FORMATS = ("png", "pdf", "svg")
"""Kinds of picture, by the ending of the file's name."""


def check_picture(path: str | os.PathLike[str]) -> Path:
    """Return `path` if a picture can be written there now; for asking before a long computation.

    Raises:
        ValueError: for an ending that is not in `FORMATS`, or a path that cannot be written.
    """
    return check_ending(path, "picture", FORMATS)


@check_arguments
def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure to `path`, whole or not at all, in the format that the ending says.

    Args:
        figure: the figure.
        path: where to, with an ending in `FORMATS`.

    Raises:
        ValueError: for an ending that is not in `FORMATS`, or a path that cannot be written.
    """
    target = check_picture(path)
    with replacing(target) as file:
        figure.savefig(file, format=target.suffix[1:].lower(), dpi=160)
