"""Gear ratios and rotors of a robot file: an armature is `N^2 J`, and counts where N is known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from reojax._internal.checks import shorten
from reojax.models.description import JointEntry


def motors(
    moving: list[str],
    joints: dict[str, JointEntry],
    gear_ratio: Mapping[str, float],
    rotor_inertia: Mapping[str, float],
    notes: list[str],
) -> tuple[list[float], list[float]]:
    """Gear ratios and rotor inertias: what is given, else the file's; an armature is `N^2 J`."""
    for entry, given in (("gear_ratio", gear_ratio), ("rotor_inertia", rotor_inertia)):
        for name, value in given.items():
            if name not in moving:
                raise ValueError(f"`{entry}` names {shorten(name)}, which does not move")
            if isinstance(value, bool | str) or not np.isreal(value) or not np.isfinite(value):
                raise ValueError(f"`{entry}[{shorten(name)}]` is {shorten(value)}; it must be a finite number")
            if entry == "gear_ratio" and not value:
                raise ValueError(f"`gear_ratio[{shorten(name)}]` is 0; a rotor turns as its joint does")
    ratios = [float(gear_ratio.get(name, joints[name].gear_ratio)) for name in moving]
    rotors, split, left_out = [], [], []
    for name, ratio in zip(moving, ratios, strict=True):
        armature = joints[name].armature
        if name in rotor_inertia:
            rotors.append(float(rotor_inertia[name]))
        elif armature and (abs(ratio) > 1 or name in gear_ratio):
            rotors.append(armature / ratio**2)
            split.append(name)
        else:
            rotors.append(0.0)
            if armature:
                left_out.append(name)
    if split:
        notes.append(f"armature N^2 J split by the gear ratio N: {shorten(', '.join(split))[1:-1]}")
    if left_out:
        notes.append(
            f"armature left out, since the file has no gear ratio to split N^2 J by (give gear_ratio=): "
            f"{shorten(', '.join(left_out))[1:-1]}"
        )
    return ratios, rotors
