"""Collision shapes of files as capsules that contain them; how much more they hold is told."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from reojax._internal.checks import shorten
from reojax.capsules import Capsule
from reojax.models import capsule_fit
from reojax.models.capsule_fit import Fit
from reojax.models.description import Shape

_LARGEST_SIZE = 1e6
"""Of a shape [m]; more is a mistake, and its volume soon no number."""
LARGEST = 64 * 2**20
"""Largest mesh file that is read [bytes]."""
ABOVE = 5
"""Folders above the robot file in which a package of meshes is looked for."""


def fit_capsules(shapes: list[tuple[int, str, Shape]], folder: Path, notes: list[str]) -> list[Capsule]:
    """Capsules for the shapes of a robot's links.

    Args:
        shapes: link's number, name in the file, and shape in the link's frame.
        folder: of the robot file.
        notes: what is left out, and how much more the capsules hold, is added here.
    """
    capsules, excess, lost = [], {}, {}
    for link, name, shape in shapes:
        try:
            fits, volume = _fit(shape, folder)
        except ValueError as error:
            lost.setdefault(str(error), []).append(name)
            continue
        if shape.kind not in ("sphere", "capsule"):
            held, true = excess.get(name, (0.0, 0.0))
            excess[name] = held + sum(fit.volume for fit in fits), true + volume
        for fit in fits:
            start, end = (shape.position + shape.rotation @ point for point in (fit.start, fit.end))
            capsules.append(Capsule(link, start, end, fit.radius))
    notes += [f"shapes left out ({reason}): {shorten(', '.join(names))[1:-1]}" for reason, names in lost.items()]
    if excess:
        ratios = ", ".join(f"{name} {held / true:.2g}" for name, (held, true) in excess.items() if true > 0)
        notes.append(f"capsules contain the file's shapes; their volume over that of the shapes' hulls: {ratios}")
    return capsules


def _fit(shape: Shape, folder: Path) -> tuple[list[Fit], float]:
    """Capsules in the shape's frame, and the shape's own volume."""
    size = np.array(shape.size)
    if shape.kind in ("sphere", "cylinder", "capsule", "box", "ellipsoid") and not (size > 0).all():
        raise ValueError(f"a {shape.kind} without extent")
    if not (np.abs(size) <= _LARGEST_SIZE).all():
        raise ValueError(f"a {shape.kind:.20} larger than {_LARGEST_SIZE:g} m")
    if shape.kind == "sphere":
        return [Fit(np.zeros(3), np.zeros(3), float(size[0]))], 4 / 3 * np.pi * size[0] ** 3
    if shape.kind == "capsule":
        along = np.array([0, 0, size[1]])
        fit = Fit(-along, along, float(size[0]))
        return [fit], fit.volume
    if shape.kind == "cylinder":
        return [capsule_fit.around_cylinder(*size)], 2 * np.pi * size[0] ** 2 * size[1]
    if shape.kind == "ellipsoid":
        return [capsule_fit.around_ellipsoid(size)], 4 / 3 * np.pi * float(np.prod(size))
    if shape.kind == "box":
        return capsule_fit.around_box(size), 8 * float(np.prod(size))
    if shape.kind == "mesh":
        vertices, faces = _read(shape, folder)
        return capsule_fit.around_mesh(vertices, faces), capsule_fit.hull_volume(vertices)
    raise ValueError(f"no capsule contains a {shape.kind:.20}")


def _read(shape: Shape, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (v, 3), scaled, and faces (f, 3)."""
    if shape.vertices is not None:
        vertices, faces = shape.vertices, shape.faces
    else:
        vertices, faces = _read_file(find_mesh(shape.file, folder))
    if not len(vertices) or not np.isfinite(vertices).all():
        raise ValueError("mesh without vertices")
    if faces is None or not len(faces):
        faces = np.arange(len(vertices))[:, None]
    scaled = np.asarray(vertices, float) * np.array(shape.size)
    if np.ptp(scaled, axis=0).max() <= 0:
        raise ValueError("mesh without extent")
    return scaled, np.asarray(faces)


def _read_file(path: Path) -> tuple[Any, Any]:
    try:
        import trimesh
    except ImportError:
        raise ValueError('meshes need trimesh: pip install "reojax[models]"') from None
    if path.stat().st_size > LARGEST:
        raise ValueError(f"mesh larger than {LARGEST} bytes")
    try:
        with path.open("rb") as file:  # the open file alone: no textures, nothing beside it, no network
            mesh: Any = trimesh.load(file, file_type=path.suffix[1:].lower(), force="mesh", process=False)
        return np.asarray(mesh.vertices), np.asarray(mesh.faces)
    except Exception as error:  # readers of damaged files raise anything
        reason = " ".join(str(error).split())[:80] or type(error).__name__
        raise ValueError(f"{path.suffix[:8]} mesh that cannot be read, {reason}") from None


def find_mesh(name: str, folder: Path) -> Path:
    """Where a mesh lies: beside the robot file or in its package, nowhere else.

    `package://NAME/rest` and `model://NAME/rest` is looked for in the nearest folder NAME that the robot file lies in,
    or that lies beside one of `ABOVE` folders above it.

    Raises:
        ValueError: if it is not there.
    """
    scheme, _, rest = name.rpartition("://")
    if scheme not in ("", "package", "model", "file"):
        raise ValueError(f"mesh by {scheme:.20}://, only files are read")
    parts = PurePosixPath(rest).parts
    above = [folder, *folder.parents][: ABOVE + 1]
    if scheme in ("package", "model") and parts:
        rooms = [place for place in above if place.name == parts[0]] + [place / parts[0] for place in above]
        inside = parts[1:]
    else:
        rooms, inside = [folder, folder.parent], parts
    for room in rooms:
        try:
            start = folder if scheme in ("", "file") else room
            target = start.joinpath(*inside).resolve()
            if target.is_relative_to(room.resolve()) and target.is_file():
                return target
        except (OSError, ValueError):  # names too long, null characters
            continue
    raise ValueError("mesh not beside the file")
