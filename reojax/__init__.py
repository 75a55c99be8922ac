"""reojax: how a robot in free fall turns itself with its own joints, differentiably, in JAX.

The public names are listed in `__init__.pyi`, which type checkers read too. Each is imported at its first use (SPEC 1
of Scientific Python), so that `import reojax`, and with it the command line's help and refusals, does not wait for JAX.
"""

import ast
import importlib
import pathlib
from typing import Any


def _listed() -> tuple[dict[str, str], list[str]]:
    """Where each public name comes from, and `__all__`, out of the stub."""
    home: dict[str, str] = {}
    names: list[str] = []
    for node in ast.parse(pathlib.Path(__file__).with_suffix(".pyi").read_text("utf-8")).body:
        if isinstance(node, ast.ImportFrom) and node.module:
            home |= {alias.name: node.module for alias in node.names}
        elif isinstance(node, ast.Assign):
            names = ast.literal_eval(node.value)
    return home, names


_HOME, __all__ = _listed()


def __getattr__(name: str) -> Any:
    if name in _HOME and _HOME[name] != __name__:
        value = getattr(importlib.import_module(_HOME[name]), name)
    elif name.startswith("_"):
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    else:  # a package or module, such as `reojax.plot` or `reojax.sweeps`
        try:
            value = importlib.import_module(f"{__name__}.{name}")
        except ModuleNotFoundError as error:
            if error.name != f"{__name__}.{name}":
                raise
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}") from None
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*__all__, *globals()})
