"""The result of a sweep: labelled arrays, to read, to save and to hand on."""

import json
import os
from collections.abc import Callable, Mapping
from functools import cached_property
from typing import Any, NamedTuple

import jax
import numpy as np

from reojax._internal.archives import read_archive
from reojax._internal.checks import shorten
from reojax._internal.files import replacing
from reojax.sweeps.grid import Designs

SCHEMA = "reojax-sweep-1"
"""Name of the layout of saved sweeps."""
LARGEST = 2**40
"""Most bytes of a saved sweep; more is no file that was meant."""


class BadDesign(NamedTuple):
    """A design that gave no finite result."""

    position: tuple[int, ...]
    """Its place in the grid."""
    design: dict[str, float]
    """Its values."""
    reason: str
    """What was wrong: a result that is not finite, or an exception."""

    def __str__(self) -> str:
        return ", ".join(f"{name}={value:g}" for name, value in self.design.items()) + f": {self.reason}"


class Sweep:
    """Results of a sweep over a grid or list of designs, with the axes and their units.

    `results` is the pytree that the function returns, each array with `shape` in front: one side per axis, or
    the length of the list of designs. Read from a file or a store it is a dict of arrays by name. With a store,
    results are read when `results` is first asked for, so that a sweep may be larger than memory.
    """

    def __init__(
        self,
        designs: Designs,
        units: Mapping[str, str],
        load: Callable[[], Any],
        failures: Mapping[int, str],
    ) -> None:
        """Keep the parts; `sweep`, `merge` and `Sweep.load` call this."""
        self.axes: dict[str, np.ndarray] = designs.axes
        """Values by axis; 1-D."""
        self.units: dict[str, str] = dict(units)
        """Units by name, of axes and of results; what has no entry has no unit given."""
        self._designs, self._load, self._failures = designs, load, dict(failures)

    @cached_property
    def results(self) -> Any:
        """The function's results, grid shape in front."""
        return self._load()

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the grid, or (length,) of a list of designs."""
        return self._designs.shape

    @property
    def dimensions(self) -> tuple[str, ...]:
        """Names of the sides of `shape`: the axes, or `design` for a list of designs."""
        return self._designs.dimensions

    @property
    def bad(self) -> list[BadDesign]:
        """Designs with a result that is not finite or with an exception, in order."""
        return [
            BadDesign(
                tuple(int(i) for i in np.unravel_index(number, self.shape)),
                self._designs.design(number),
                self._failures[number],
            )
            for number in sorted(self._failures)
        ]

    def design(self, number: int) -> dict[str, float]:
        """Values of one design, by its `number` through the flattened grid, the last axis running fastest."""
        return self._designs.design(number)

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the results as a flat dict: `turn.angle` is the field `angle` of the entry `turn`."""
        leaves, _ = jax.tree_util.tree_flatten_with_path(self.results)
        return {jax.tree_util.keystr(path, simple=True, separator=".") or "result": leaf for path, leaf in leaves}

    def to_xarray(self) -> Any:
        """Return an xarray data set with the axes as coordinates, labelled with units (extra `xarray`).

        Raises:
            ImportError: if xarray is not installed.
        """
        try:
            import xarray  # pyright: ignore[reportMissingImports]
        except ImportError as error:
            raise ImportError("`to_xarray` needs xarray: pip install 'reojax[xarray]'.") from error

        def label(name: str, dimensions: tuple[str, ...], values: np.ndarray) -> tuple[Any, ...]:
            return dimensions, values, {"units": self.units[name]} if name in self.units else {}

        inner = {name: values.shape[len(self.shape) :] for name, values in self.arrays().items()}
        variables = {
            name: label(name, (*self.dimensions, *(f"{name}_{i}" for i in range(len(inner[name])))), values)
            for name, values in self.arrays().items()
        }
        zipped = self._designs.zipped
        coordinates = {
            name: label(name, self.dimensions if zipped else (name,), values) for name, values in self.axes.items()
        }
        return xarray.Dataset(variables, coordinates, {"source": "reojax.sweep"})

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a NumPy archive (.npz): `axes/NAME`, `results/NAME`, and JSON text in `about`.

        `about` has units, dimensions and the bad designs. The file is written whole or not at all; any NumPy
        reads it, and so does `Sweep.load`.

        Raises:
            ValueError: if the path cannot be written.
        """
        about = {
            "schema": SCHEMA,
            "axes": list(self.axes),
            "zipped": self._designs.zipped,
            "shape": list(self.shape),
            "results": list(self.arrays()),
            "units": self.units,
            "bad": {str(number): reason for number, reason in self._failures.items()},
        }
        members = {f"axes/{name}": values for name, values in self.axes.items()}
        members |= {f"results/{name}": values for name, values in self.arrays().items()}
        with replacing(path) as file:
            np.savez(file, allow_pickle=False, about=np.array(json.dumps(about)), **members)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> "Sweep":
        """Read what `save` wrote; `results` is a dict of arrays by name.

        Raises:
            ValueError: if the file cannot be read, or is not a saved sweep.
        """
        try:
            arrays = read_archive(path, LARGEST)
            about = json.loads(str(arrays["about"]))
            if about["schema"] != SCHEMA:
                raise ValueError(f"its layout is {shorten(about['schema'])}; this reojax reads {SCHEMA!r}")
            axes = {name: arrays[f"axes/{name}"] for name in about["axes"]}
            results = {name: arrays[f"results/{name}"] for name in about["results"]}
            for name, values in axes.items():
                if (
                    values.ndim != 1
                    or not values.size
                    or values.dtype.kind not in "iuf"
                    or not np.isfinite(values).all()
                ):
                    raise ValueError(f"axis {name!r} is {values.dtype}{list(values.shape)}, or not finite")
            designs = Designs(axes, bool(about["zipped"]))
            rows = {len(values) for values in axes.values()}
            if list(designs.shape) != about["shape"] or (designs.zipped and len(rows) > 1):
                raise ValueError(f"its axes make the shape {list(designs.shape)}, and not {shorten(about['shape'])}")
            for name, values in results.items():
                if values.shape[: len(designs.shape)] != designs.shape or values.dtype.kind not in "biufc":
                    raise ValueError(f"result {name!r} is {values.dtype}{list(values.shape)}")
            failures = {int(number): str(reason) for number, reason in about["bad"].items()}
            if not all(0 <= number < designs.total for number in failures):
                raise ValueError("a bad design is none of its designs")
            units = {str(name): str(unit) for name, unit in about["units"].items()}
        except Exception as error:
            reason = f"there is no {error}" if isinstance(error, KeyError) else str(error).rstrip(".")
            raise ValueError(f"cannot read {shorten(str(path))} as a sweep: {reason}.") from error
        return Sweep(designs, units, lambda: results, failures)

    def __repr__(self) -> str:
        sides = " x ".join(f"{name} {side}" for name, side in zip(self.dimensions, self.shape, strict=True))
        return f"Sweep({sides}, {len(self._failures)} bad)"
