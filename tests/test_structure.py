"""Imports point one way, the package's import stays light, and it changes no global setting."""

import ast
import importlib
import re
import subprocess
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

import reojax

ROOT = Path(__file__).parent.parent
PACKAGE = ROOT / "reojax"

ORDER = (
    "_internal session so3 path manoeuvres capsules robot sweeps mechanics collision robots models interop "
    "optimisation motion design planning captures steering files drawing plot viewer cli"
).split()
"""Packages and single modules, each of which imports only what stands before it."""


def _name(file: Path) -> str:
    parts = file.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1]) if parts[-1] == "__init__" and len(parts) > 1 else ".".join(parts)


MODULES = {_name(file): file for file in PACKAGE.rglob("*.py") if file.read_text().count("import ")}


def _imports(file: Path) -> set[str]:
    """Modules of the package that a file reads when it is imported or when its functions run."""
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] == "reojax":
            inside = node.module.removeprefix("reojax").lstrip(".")
            submodules = {f"{inside}.{alias.name}".lstrip(".") for alias in node.names}
            found |= (submodules & MODULES.keys()) or {inside}
    return found - {""}


def _room(module: str) -> str:
    return module.partition(".")[0]


@pytest.mark.parametrize("module", sorted(MODULES.keys() - {"__init__", "__main__"}))
def test_packages_import_one_way(module):
    """Each package has a place in the order, and reads only from those before it and from itself."""
    assert _room(module) in ORDER, f"give {_room(module)} a place in ORDER"
    later = {name for name in _imports(MODULES[module]) if ORDER.index(_room(name)) > ORDER.index(_room(module))}
    assert not later


def test_no_circles_inside_a_package():
    """Modules can be put in an order in which each imports only earlier ones."""
    TopologicalSorter({name: _imports(file) - {name} for name, file in MODULES.items()}).prepare()


def test_few_files_lie_beside_the_packages():
    assert len([file for file in PACKAGE.glob("*.py")]) <= 8


def test_the_page_on_architecture_shows_the_packages_and_files_that_there_are():
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    tree = page[page.index("reojax/\n") : page.index("## Where is")]
    assert {f.name for f in PACKAGE.iterdir() if (f / "__init__.py").exists()} == set(
        re.findall(r"^  (\w+)/", tree, re.M)
    )
    looked_for = page[page.index("## Where is") : page.index("## One number")]
    files = re.findall(r"`([\w/]+\.py)`", looked_for)
    assert len(files) > 10
    assert not [file for file in files if not (PACKAGE / file).is_file()]


def test_no_function_hides_a_package():
    """`reojax.sweeps.merge`, and not an AttributeError of a function `sweep`."""
    for folder in (f for f in PACKAGE.iterdir() if (f / "__init__.py").exists() and not f.name.startswith("_")):
        module = importlib.import_module(f"reojax.{folder.name}")
        assert getattr(reojax, folder.name) is module


def test_the_public_list_is_complete():
    assert all(hasattr(reojax, name) for name in reojax.__all__)
    assert len(set(reojax.__all__)) == len(reojax.__all__)
    assert reojax.Path.__module__ == "reojax.path"  # and not what __init__ imports for itself
    assert set(reojax._HOME) == set(reojax.__all__) <= set(dir(reojax))


def test_unknown_names_are_attribute_errors():
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        _ = reojax.nonsense


@pytest.mark.parametrize("arguments", [[], ["--help"], ["--version"], ["simulate", "--help"], ["sweep", "twist=x"]])
def test_help_and_refusals_do_not_wait_for_jax(arguments):
    code = f"""
import sys, reojax, reojax.cli
reojax.cli.main({arguments!r})
assert not {{"jax", "numpy", "scipy"}} & set(sys.modules)
"""
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True, capture_output=True)


@pytest.mark.parametrize("file", [*(ROOT / "experiments").rglob("*.py")], ids=lambda file: file.name)
def test_experiments_use_only_what_is_public(file):
    assert not re.search(r"reojax(\.[a-z]\w*)*\._|from reojax import _|sys\.path", file.read_text())


def test_only_the_plots_import_matplotlib():
    """Pictures are drawn in one package."""
    using = {name for name, file in MODULES.items() if "matplotlib" in file.read_text()}
    assert {_room(name) for name in using} == {"plot"}


def test_annotations_stay_strings():
    """Making the array types of all signatures would take a third of the time of `import reojax`."""
    using = {name: file.read_text() for name, file in MODULES.items() if "from jaxtyping" in file.read_text()}
    assert not {name for name, text in using.items() if "from __future__ import annotations" not in text}


def test_import_is_light_and_changes_nothing():
    """No matplotlib, no optax, no JAX backend, no x64 after `import reojax`."""
    code = """
import sys, jax
before = dict(jax.config.values)
import reojax
assert [getattr(reojax, name) for name in reojax.__all__ if name != "plot"]
assert dict(jax.config.values) == before
assert not {"matplotlib", "optax", "scipy.optimize"} & set(sys.modules)
from jax._src import xla_bridge
assert not xla_bridge.backends_are_initialized()
"""
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)
