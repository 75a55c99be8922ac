"""What all commands have in common: options, settings, errors, and a description of the machine."""

import argparse
import os
import platform
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import jax
from systems._measure import CORES

import reojax
from reojax.session import hold_memory, one_device_per_core

PACKAGES = (
    *("jax", "jaxlib", "numpy", "scipy", "pin", "mujoco", "mujoco-mjx", "casadi"),
    *("adam-robotics", "diffrax", "equinox"),
)


def options(doc: str | None) -> argparse.ArgumentParser:
    """Parser with the options that all commands have; `doc` is the command's docstring."""
    summary, _, rest = (doc or "").partition("\n")
    parser = argparse.ArgumentParser(
        description=summary, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="smaller and noisier, for trying out")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder for results (default: out)")
    return parser


def comparison_options(doc: str | None) -> argparse.ArgumentParser:
    """The same for commands that choose rows and compare with another version."""
    parser = options(doc)
    parser.add_argument("--against", type=Path, metavar="FOLDER", help="root of another version's files")
    parser.add_argument("--only", nargs="+", metavar="TEXT", help="rows whose names contain one of these")
    return parser


def versions(against: Path | None) -> dict[str, Path]:
    """Roots of the versions to compare, this one first."""
    return {"this": Path(reojax.__file__).parents[1]} | ({"other": against} if against else {})


def chosen(names: Iterable[str], only: list[str] | None) -> list[str]:
    """The rows that are asked for."""
    return [name for name in names if only is None or any(text in name for text in only)]


def run(main: Callable[..., None], parser: argparse.ArgumentParser) -> None:
    """Call `main` with the options, float64 on and no compilation cache; exit 2 on bad input."""
    arguments = vars(parser.parse_args())
    settings()
    try:
        out = arguments["out"]
        try:
            out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ValueError(f"cannot make the folder {str(out)!r}: {error.strerror}.") from error
        main(**arguments)
    except ValueError as error:
        parser.exit(2, f"{parser.prog}: {error}\n")
    except KeyboardInterrupt:
        parser.exit(130, f"{parser.prog}: stopped\n")


def settings() -> None:
    """Switch float64 on and the compilation cache off, hold freed memory, and make each core a device.

    All rows but the ones that say so use the first of these devices, which may use all threads.
    """
    hold_memory()
    one_device_per_core()
    jax.config.update("jax_enable_x64", True)
    jax.config.update("jax_enable_compilation_cache", False)


def machine() -> dict[str, Any]:
    """Processor, cores, load, and versions of everything."""
    return {
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
        "processor": _processor(),
        "cores": CORES,
        "load": list(os.getloadavg()) if hasattr(os, "getloadavg") else None,
        "system": platform.platform(),
        "jax devices": [str(device) for device in jax.devices()],
        "versions": {
            "python": platform.python_version(),
            "gcc": _gcc(),
            "reojax": _version("reojax") or "not installed, from its folder",
            **{package: _version(package) for package in PACKAGES},
        },
    }


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.exists():
        for line in information.read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _gcc() -> str | None:
    if not shutil.which("gcc"):
        return None
    return subprocess.run(["gcc", "-dumpfullversion"], capture_output=True, text=True).stdout.strip()


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def say(text: str) -> None:
    """Tell the user how it goes, apart from the results."""
    print(text, file=sys.stderr, flush=True)
