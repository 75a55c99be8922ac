"""Hook of MkDocs: pages of the API reference out of the lists of public names, guides, and the gallery's notebook.

The names come from `reojax/__init__.pyi` and from the `__init__.py` of the public packages, so a new public name is in
the reference without anybody's doing. Read as text: nothing of reojax is imported.
"""

import ast
import json
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PACKAGES = ("design", "plot", "robots", "sweeps")
"""Public packages whose own names are public too."""
PAGES = {
    "robots": (
        "Robots and models",
        "Robots from numbers, by name, and from files.",
        ("robot", "capsules", "robots", "models"),
    ),
    "mechanics": ("Mechanics", "The momentum equation, poses, dynamics, and the turn after a path.", ("mechanics",)),
    "paths": ("Paths and manoeuvres", "What the joints go through, without when.", ("path", "manoeuvres")),
    "so3": ("so3: rotations", "Safe values and gradients at the identity and at half turns.", ("so3",)),
    "clearance": ("Clearance", "How far links stay from each other.", ("collision",)),
    "planning": ("Planning", "Paths that end on a wanted orientation.", ("planning",)),
    "design": ("design", "Design problems, sensitivities and spread.", ("design", "optimisation")),
    "motion": ("Motion in time", "Time laws, motors, least time, control, releases.", ("motion",)),
    "steering": ("Steering", "Corrections on the way.", ("steering",)),
    "captures": (
        "Captures and files",
        "Measured motion, calibration, files for other programs.",
        ("captures", "files", "interop"),
    ),
    "sweeps": ("Sweeps and sessions", "Any function over many designs; compiled programs kept.", ("sweeps", "session")),
    "viewer": ("Viewer and plot", "Pages for a browser, pictures and films.", ("viewer", "drawing", "plot")),
}
"""Page -> title, a line below it, and the packages whose names are on it."""
_ENTRY = """::: {where}
    options:
      heading: {name}
      toc_label: {name}
      heading_level: 2
      show_root_heading: true
"""
"""Entry of a name, for mkdocstrings."""
_MODULES = {"so3"}
"""Modules that are public whole."""


def public_names() -> dict[str, str]:
    """Every public name, such as `reojax.design.Problem` -> the module that defines it."""
    found: dict[str, str] = {}
    stub = ast.parse((ROOT / "reojax" / "__init__.pyi").read_text("utf-8"))
    for name, home in _imported(stub):
        if home != "reojax":
            found[f"reojax.{name}"] = home
    for package in PACKAGES:
        tree = ast.parse((ROOT / "reojax" / package / "__init__.py").read_text("utf-8"))
        for name, home in _imported(tree):
            if found.get(f"reojax.{name}") != home:
                found[f"reojax.{package}.{name}"] = home
    for module in (*_MODULES, *PACKAGES):
        place = ROOT / "reojax" / module
        file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
        for node in ast.parse(file.read_text("utf-8")).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                found[f"reojax.{module}.{node.name}"] = f"reojax.{module}"
    return found


def pages() -> dict[str, str]:
    """Markdown of each page by its path in the site."""
    names = public_names()
    written = {}
    for page, (title, line, packages) in PAGES.items():
        inside = {name: home for name, home in names.items() if _room(home) in packages}
        parts = [f"# {title}\n\n{line}\n"]
        for name in sorted(inside, key=lambda name: (name.count("."), name.lower())):
            last = name.rpartition(".")[2]
            parts.append(_ENTRY.format(name=name, where=f"{inside[name]}.{last}"))
        if inside:
            written[f"reference/{page}.md"] = "\n".join(parts)
    return written


def on_config(config: Any) -> Any:
    """Add guides that `mkdocs.yml` does not name to the end of its list of guides."""
    named = str(config["nav"])
    guides = next(entry["Guides"] for entry in config["nav"] if "Guides" in entry)
    guides += [page.name for page in sorted((ROOT / "docs").glob("*.md")) if page.name not in named]
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pages to those that MkDocs found."""
    from mkdocs.structure.files import File

    for path, text in pages().items():
        files.append(File.generated(config, path, content=text))
    files.append(
        File.generated(config, "gallery.ipynb", content=notebook((ROOT / "docs" / "gallery.md").read_text("utf-8")))
    )
    return files


def notebook(page: str) -> str:
    """A page as a Jupyter notebook: its Python blocks as cells, what is between them as text."""
    cells = []
    for k, part in enumerate(re.split(r"^```python\n(.*?)^```\n", page, flags=re.DOTALL | re.MULTILINE)):
        kind = ({"cell_type": "markdown"}, {"cell_type": "code", "outputs": [], "execution_count": None})[k % 2]
        if part.strip():
            cells.append({**kind, "id": f"cell-{k}", "metadata": {}, "source": part.strip().splitlines(keepends=True)})
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return json.dumps(
        {"nbformat": 4, "nbformat_minor": 5, "metadata": {"kernelspec": kernel}, "cells": cells}, indent=1
    )


def _imported(tree: ast.Module) -> list[tuple[str, str]]:
    return [
        (alias.asname or alias.name, node.module)
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("reojax")
        for alias in node.names
        if not alias.name.startswith("_")
    ]


def _room(home: str) -> str:
    return home.split(".")[1]
