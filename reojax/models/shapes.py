"""Collision shapes of files as capsules that contain them."""

from __future__ import annotations

from pathlib import Path

from reojax.capsules import Capsule
from reojax.models.description import Shape


def fit_capsules(shapes: list[tuple[int, str, Shape]], folder: Path, notes: list[str]) -> list[Capsule]:
    """Capsules for the shapes of a robot's links."""
    return []
