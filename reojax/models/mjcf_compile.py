"""An MJCF compiled by MuJoCo, without what only pictures need, and with meshes looked for where they may lie."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

from reojax.models.mjcf_names import without_repeated_names

_TWICE = re.compile(r"repeated name .* in (texture|material|geom|light|camera)")


def compile_mjcf(path: str | os.PathLike[str], notes: list[str]) -> Any:
    """MuJoCo's model of a file; `notes` gets what was left out.

    Raises:
        ValueError: with MuJoCo's own words, if it does not take the file.
        ImportError: saying what to install.
    """
    try:
        import mujoco
    except ImportError as error:
        raise ImportError('reading MJCF needs MuJoCo: pip install "reojax[models]"') from error
    try:
        spec = _spec(mujoco, path, notes)
        spec.compiler.fusestatic = False
        try:
            return spec.compile()
        except (ValueError, RuntimeError):
            _strip(spec, Path(path).resolve().parent, notes)  # pictures that are missing do not matter
            return spec.compile()
    except (ValueError, RuntimeError, FileNotFoundError) as error:
        raise ValueError(f"MuJoCo does not take it: {' '.join(str(error).split())[:400]}") from None


def _spec(mujoco: Any, path: str | os.PathLike[str], notes: list[str]) -> Any:
    """The file as MuJoCo reads it, where names of pictures and shapes come twice without them."""
    try:
        return mujoco.MjSpec.from_file(os.fspath(path))
    except ValueError as error:
        if not _TWICE.search(str(error)):
            raise
    text, parts = without_repeated_names(Path(path))
    notes.append("textures, materials and names of shapes left out: the file and those it includes give some twice")
    return mujoco.MjSpec.from_string(text, include=parts)


def _strip(spec: Any, folder: Path, notes: list[str]) -> None:
    """Take out what only pictures need, and meshes whose files are missing."""
    for geom in spec.geoms:
        geom.material = ""
    for group in (spec.materials, spec.textures, spec.skins):
        for item in list(group):
            spec.delete(item)
    lost = set()
    for mesh in spec.meshes:
        if not mesh.file or (folder / (spec.meshdir or "") / mesh.file).is_file():
            continue
        found = [path for path in folder.glob(f"*/{Path(mesh.file).name}") if path.is_file()]
        if len(found) == 1:
            mesh.file = str(found[0])
            notes.append(f"mesh {mesh.name!r} found in the folder {found[0].parent.name!r}")
        else:
            lost.add(mesh.name)
    for geom in list(spec.geoms):
        if geom.meshname in lost:
            body = geom.parent
            if not body.explicitinertial and geom.mass != 0 and body is not spec.worldbody:
                raise ValueError(
                    f"link {body.name!r} has its inertia from mesh {geom.meshname!r}, whose file is missing"
                )
            notes.append(f"shape left out: mesh {geom.meshname!r} of link {body.name!r}, whose file is missing")
            spec.delete(geom)
    for mesh in list(spec.meshes):
        if mesh.name in lost:
            spec.delete(mesh)
