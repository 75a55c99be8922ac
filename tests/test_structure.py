"""Imports point one way, the package's import stays light, and it changes no global setting."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parent.parent / "reojax"

LAYERS = [
    ["_arrays", "_robot_checks", "_output", "_session", "_shown"],
    ["_smallmat", "_orientation", "so3", "robot", "path"],
    ["momentum", "manoeuvres"],
    ["_fast.scalar", "_fast.store"],
    ["_fast.sincos", "_fast.components", "_fast.nodes", "_fast.product", "_fast.blocks"],
    ["_fast.omega", "_fast.steps"],
    ["_fast.momentum"],
    ["_fast.virtual"],
    ["_fast.endpoint"],
    ["holonomy", "curvature"],
    ["robots._solids"],
    ["robots.prototype", "robots.planar", "robots.two_cylinder_cat"],
    ["robots.six_body"],
    ["robots"],
    ["certificate"],
    ["sweep.grid", "sweep.devices"],
    ["sweep.outputs", "sweep.chunks", "sweep.table"],
    ["sweep.identity", "sweep.engine", "sweep.memory", "sweep.progress"],
    ["sweep.store"],
    ["sweep.merge", "sweep.resume"],
    ["sweep.run", "sweep.turns"],
    ["sweep"],
    ["design._quadratic"],
    ["design._steps"],
    ["design.solver"],
    ["design.descent", "design.variables", "design.edits", "design.tolerances"],
    ["design.loops"],
    ["design.smooth", "design.problem"],
    ["design.measures"],
    ["design.certainty"],
    ["design"],
    ["plan.quaternions", "plan.words", "plan.checks"],
    ["plan.closed"],
    ["plan.free"],
    ["plan.loops"],
    ["plan.chain", "plan.starts"],
    ["plan.search"],
    ["plan.attempts"],
    ["plan.grouped"],
    ["plan.decide", "plan.result"],
    ["plan"],
    ["_lie", "_spline", "dynamics"],
    ["time_law", "motor"],
    ["trajectory"],
    ["motion"],
    ["minimum_time", "_polish"],
    ["_least_duration"],
    ["fastest"],
    ["_capture_columns", "_parameters"],
    ["capture", "release", "export"],
    ["comparison", "control"],
    ["calibrate"],
    ["plot._style", "plot.files", "plot._view", "plot._solids"],
    ["plot.history", "plot.robots", "plot.capture", "plot.control", "plot.sweeps", "plot.motion"],
    ["plot.frames", "plot.maps", "plot.plans"],
    ["plot"],
    ["cli._arguments"],
    ["cli._axes", "cli._results", "cli._planned", "cli._manoeuvre", "cli._motors"],
    ["cli._motion"],
    ["cli.simulate", "cli.time", "cli.compare", "cli.export", "cli.sweep", "cli.merge", "cli.plan"],
    ["cli"],
    ["__init__", "__main__"],
]
RANK = {module: rank for rank, layer in enumerate(LAYERS) for module in layer}


def _name(file: Path) -> str:
    parts = file.relative_to(PACKAGE).with_suffix("").parts
    return ".".join(parts[:-1]) if parts[-1] == "__init__" and len(parts) > 1 else ".".join(parts)


MODULES = {_name(file): file for file in PACKAGE.rglob("*.py") if file.read_text().count("import ")}


def _imports(file: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("reojax"):
            inside = node.module.removeprefix("reojax").lstrip(".")
            submodules = {f"{inside}.{a.name}".lstrip(".") for a in node.names}
            found |= (submodules & RANK.keys()) or {inside or "__init__"}
    return found


@pytest.mark.parametrize("module", sorted(MODULES))
def test_a_module_imports_only_what_stands_before_it(module):
    """Each module has a place in the order, and reads only from lower ones."""
    assert module in RANK, f"give {module} a place in LAYERS"
    assert not {name for name in _imports(MODULES[module]) if RANK[name] >= RANK[module]}


def test_only_the_plots_import_matplotlib():
    """Pictures are drawn in one package."""
    using = {name for name, file in MODULES.items() if "matplotlib" in file.read_text()}
    assert {name.partition(".")[0] for name in using} == {"plot"}


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
assert dict(jax.config.values) == before
assert not {"matplotlib", "optax", "scipy.optimize"} & set(sys.modules)
from jax._src import xla_bridge
assert not xla_bridge.backends_are_initialized()
"""
    subprocess.run([sys.executable, "-W", "error", "-c", code], check=True)
