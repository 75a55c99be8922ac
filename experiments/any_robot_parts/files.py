"""Where installed packages keep their robot files (extra `zoo`); nothing is copied or fetched."""

import re
import sys
from importlib.util import find_spec
from pathlib import Path

PACKAGES = {
    "example-robot-data": ("urdf", "site", "cmeel.prefix/share/example-robot-data/robots"),
    "icub-models": ("urdf", "prefix", "share/iCub"),
    "pybullet": ("urdf", "package", "pybullet_data"),
    "spartpy": ("urdf", "package", "SPARTpy"),
    "gymnasium": ("xml", "package", "gymnasium"),
    "dm_control": ("xml", "package", "dm_control"),
}
"""Ending of the files, kind of place, and place."""

_MOVES = re.compile(r"type=.(revolute|continuous|prismatic|spherical|floating|planar)")
_BODIES = re.compile(r"<body\b")
_INCLUDES = re.compile(r"<include\s+file=[\"']([^\"']+)")


class Missing(ValueError):
    """A package with robot files is not installed."""


def robot_files(package: str) -> list[Path]:
    """Robot files of a package: URDFs with a joint that moves, MJCFs with a body or an include that is there.

    Raises:
        Missing: if the package is not installed.
    """
    return [file for file in sorted(folder_of(package).rglob(f"*.{PACKAGES[package][0]}")) if _is_robot(file)]


def folder_of(package: str) -> Path:
    """Folder in which a package keeps its robot files.

    Raises:
        Missing: if the package is not installed.
    """
    _, kind, place = PACKAGES[package]
    folder = _folder(kind, place)
    if folder is None or not folder.is_dir():
        raise Missing(f'{package} is not installed: pip install "reojax[zoo]"')
    return folder


def _folder(kind: str, place: str) -> Path | None:
    if kind == "prefix":
        return Path(sys.prefix) / place
    found = find_spec("numpy" if kind == "site" else place)
    if found is None or not found.submodule_search_locations:
        return None
    here = Path(found.submodule_search_locations[0])
    return here.parent / place if kind == "site" else here


def _is_robot(file: Path) -> bool:
    text = file.read_text(errors="replace")
    if file.suffix == ".urdf":
        return bool(_MOVES.search(text))
    there = any((file.parent / name).is_file() for name in _INCLUDES.findall(text))
    return "<mujoco" in text.replace("<mujocoinclude", "") and (there or bool(_BODIES.search(text)))
