"""An MJCF and the files it includes, without pictures and without names that come twice and name no part of a robot."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

from reojax._internal.json_files import read_bytes
from reojax.models.urdf import parse_xml

_PICTURES = ("texture", "material", "skin")
_UNNAMED = ("geom", "light", "camera")
"""Elements that the first alone of one name keeps it."""
_FILES = ("mesh", "hfield")
"""Elements whose files are still needed."""
_MOST = 100
"""Files that one may include."""


def without_repeated_names(path: Path) -> tuple[str, dict[str, bytes]]:
    """The file as text, and what it includes by name; files of meshes by their whole paths.

    Raises:
        ValueError: naming a file that cannot be read.
    """
    folder = path.resolve().parent
    main = parse_xml(read_bytes(path).lstrip())
    trees, waiting = {"": main}, [main]
    while waiting:
        for element in waiting.pop().iter("include"):
            name = element.get("file", "")
            if name in trees or not (folder / name).is_file():
                continue  # MuJoCo says what is wrong with it
            if len(trees) > _MOST:
                raise ValueError(f"it includes more than {_MOST} files")
            trees[name] = parse_xml(read_bytes(folder / name).lstrip())
            waiting.append(trees[name])
    meshes = folder
    for tree in trees.values():
        for compiler in tree.iter("compiler"):
            meshes = folder / (compiler.get("meshdir") or compiler.get("assetdir") or os.path.relpath(meshes, folder))
    taken: set[tuple[str, str | None]] = set()
    for tree in trees.values():
        _leave_out(tree, meshes)
        for element in tree.iter():
            if element.tag in _UNNAMED and (element.tag, element.get("name")) in taken:
                element.attrib.pop("name", None)
            taken.add((element.tag, element.get("name")))
    text = {name: ElementTree.tostring(tree) for name, tree in trees.items()}
    return text.pop("").decode(), text


def _leave_out(tree: ElementTree.Element, meshes: Path) -> None:
    for parent in list(tree.iter()):
        for child in list(parent):
            if child.tag in _PICTURES:
                parent.remove(child)
            elif child.tag in _FILES and child.get("file"):
                child.set("file", os.fspath(meshes / child.get("file", "")))
        parent.attrib.pop("material", None)
