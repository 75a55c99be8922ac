"""The door of `make_robot`: plain numbers in, checked NumPy arrays out, or a `ValueError`."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from reojax._internal.arrays import is_concrete
from reojax._internal.capsule_checks import check_capsules, check_pairs, default_pairs
from reojax._internal.checks import index_of, listing, numbers, refuse, shorten
from reojax._internal.definiteness import check_energy
from reojax._internal.inertias import NOISE, breaks_triangle
from reojax._internal.precision import warn_user

_TOLERANCE = 1e-6
"""Relative rounding allowed in unit lengths, symmetry and the triangle rule (float32 data pass)."""
_NAMED = 3
"""Pairs of links that a note names."""
_MANY_TURNS = 8 * np.pi
"""Limits beyond this are asked about [rad]."""


def _as_list(entry: str, value: Any, default: Sequence[Any], what: str) -> tuple[Any, ...]:
    if value is None:
        return tuple(default)
    items = tuple(value) if isinstance(value, Iterable) and not isinstance(value, str) else None
    if items is None or len(items) != len(default):
        raise ValueError(f"`{entry}` is {shorten(value)}; it must list {what}.")
    return items


def _names(entry: str, value: Any, default: list[str]) -> tuple[str, ...]:
    names = _as_list(entry, value, default, f"{len(default)} names")
    for k, name in enumerate(names):
        if not isinstance(name, str) or not name:
            raise ValueError(f"{entry}[{k}] is {shorten(name)}; it must be a non-empty string.")
        if name in names[:k]:
            raise ValueError(f"{entry}[{k}] is {shorten(name)}, which is taken; names must differ.")
    return names


def _parents(value: Any, joints: int) -> tuple[int, ...]:
    parents = _as_list("parent", value, range(joints), f"the link that each of {joints} joints hangs from")
    for k, parent in enumerate(parents):
        if isinstance(parent, bool) or not isinstance(parent, int | np.integer) or not 0 <= parent <= k:
            raise ValueError(
                f"parent[{k}] is {shorten(parent)}; joint {k} carries link {k + 1}, so its parent must be a link "
                f"that comes before: an integer from 0 to {k}."
            )
    return tuple(int(p) for p in parents)


def _sides(value: Any, joints: int) -> tuple[str, ...]:
    rule = f"'parent' or 'child' for each of {joints} joints"
    sides = _as_list("rotor_on", value, ("parent",) * joints, rule)
    for k, side in enumerate(sides):
        if side not in ("parent", "child"):
            raise ValueError(f"rotor_on[{k}] is {shorten(side)}; it must be 'parent' or 'child'.")
    return tuple(str(side) for side in sides)


def _inertias(value: Any, names: Sequence[str]) -> np.ndarray:
    inertia = numbers("inertia", value, (len(names), 3, 3))
    for i, (matrix, name) in enumerate(zip(inertia, names, strict=True)):
        if np.abs(matrix - matrix.T).max() > _TOLERANCE * np.abs(matrix).max():
            raise ValueError(f"inertia[{i}] ({name}) is {matrix.tolist()}; it must be symmetric.")
        size = np.abs(matrix).max() or 1.0  # moments near the end of the range of floats have squares beyond it
        small, middle, large = moments = size * np.linalg.eigvalsh(0.5 * (matrix + matrix.T) / size)
        if breaks_triangle(moments, NOISE * np.abs(inertia).max()):
            raise ValueError(
                f"inertia[{i}] ({name}) has principal moments {small:.6g}, {middle:.6g}, {large:.6g} kg m^2; of "
                "a rigid body's none is negative, and none is larger than the sum of the other two."
            )
    return 0.5 * (inertia + inertia.swapaxes(1, 2))


def _couplings(value: Any, names: tuple[str, ...]) -> dict[str, Any]:
    """Coupled joints as the fields `couplings`, `coupling_ratio` and `coupling_offset` of `Robot`."""

    pairs, numbers_ = [], []
    if value is not None and not isinstance(value, Mapping):
        raise ValueError(f"`couplings` is {shorten(value)}; it must map joints to (driver, ratio, offset).")
    for key, rule in (value or {}).items():
        if not isinstance(rule, tuple | list) or len(rule) != 3:
            raise ValueError(f"couplings[{shorten(key)}] is {shorten(rule)}; it must be (driver, ratio, offset).")
        follower = index_of("a key of couplings", key, names, "joint")
        pairs.append((follower, index_of(f"couplings[{names[follower]!r}][0]", rule[0], names, "joint")))
        numbers_.append(numbers(f"couplings[{names[follower]!r}][1:]", rule[1:], (2,)))
    followers = {follower for follower, _ in pairs}
    for follower, driver in pairs:
        if driver in followers:
            raise ValueError(f"joint {names[follower]!r} follows {names[driver]!r}, which must not follow another one.")
    both = np.array(numbers_, float).reshape(-1, 2)
    return {"couplings": tuple(pairs), "coupling_ratio": both[:, 0].copy(), "coupling_offset": both[:, 1].copy()}


def ask_for_degrees(lower: np.ndarray, upper: np.ndarray, names: Sequence[str]) -> None:
    """Warn of limits of more than four turns: they are legal, and mostly degrees."""
    for entry, limits in (("lower", lower), ("upper", upper)):
        for k in map(int, np.flatnonzero(np.isfinite(limits) & (np.abs(limits) > _MANY_TURNS))):
            warn_user(
                f"{entry}[{k}] ({names[k]}) is {limits[k]:g} rad, {abs(limits[k]) / (2 * np.pi):.1f} turns: "
                "are these degrees? Limits are in rad."
            )
            return


def check_entries(*, mass: Any, axis: Any, name: Any, **entries: Any) -> dict[str, Any]:
    """Check the arguments of `make_robot`; return the fields of `Robot`, defaults filled in."""
    for entry, value in {"mass": mass, "axis": axis, **entries}.items():
        if not is_concrete(value):
            raise ValueError(
                f"`{entry}` is traced; make_robot checks numbers, so it runs outside of jit, vmap and grad. Inside, "
                f"change a robot that is there: robot.replace({entry}=...), robots.with_gear_ratio and its kin."
            )
    mass = numbers("mass", mass, (-1,))
    links, joints = len(mass), len(mass) - 1
    if not links:
        raise ValueError("`mass` is empty; a robot has at least one link.")
    axis = numbers("axis", axis, (joints, 3))  # the first entry to disagree with the number of masses
    link_names = _names("link_names", entries["link_names"], [f"link{i}" for i in range(links)])
    joint_names = _names("joint_names", entries["joint_names"], [f"joint{k}" for k in range(joints)])
    refuse("mass", mass, mass < 0, "a link's mass must not be negative", " kg", link_names)
    if not mass.any():
        raise ValueError("`mass` is 0 kg for every link; a robot has some mass.")
    axis = _unit_axes(axis, joint_names)
    motors = _motors_and_limits(entries, joint_names)
    if not isinstance(name, str):
        raise ValueError(f"`name` is {shorten(name)}; it must be a string.")
    fields = {
        "mass": mass,
        "com": numbers("com", entries["com"], (links, 3)),
        "inertia": _inertias(entries["inertia"], link_names),
        "axis": axis,
        "anchor": numbers("anchor", entries["anchor"], (joints, 3)),
        "parent": _parents(entries["parent"], joints),
        "gear_ratio": _per_joint(entries, "gear_ratio", joints, 1.0),
        "rotor_on": _sides(entries["rotor_on"], joints),
        **motors,
        "link_names": link_names,
        "joint_names": joint_names,
        "name": name,
        "layout": entries["layout"],
    }
    fields |= _couplings(entries["couplings"], joint_names)
    fields |= check_capsules(entries["capsules"], link_names)
    fields["notes"] = (*map(str, listing("notes", entries["notes"], "strings")), *check_energy(fields))
    _add_pairs(fields, entries["collision_pairs"])
    for field in fields.values():
        if isinstance(field, np.ndarray):
            field.setflags(write=False)
    return fields


def _per_joint(entries: Mapping[str, Any], entry: str, joints: int, default: float, **kind: Any) -> np.ndarray:
    value = entries[entry]
    return numbers(entry, np.full(joints, default) if value is None else value, (joints,), **kind)


def _unit_axes(axis: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Axes of length one to rounding, refused if they are further from it."""
    length = np.linalg.norm(axis, axis=1)
    for k in map(int, np.flatnonzero(np.abs(length - 1) > _TOLERANCE)):
        raise ValueError(
            f"axis[{k}] ({names[k]}) is {axis[k].tolist()}, of length {length[k]:.9g}; it must have unit length."
        )
    return axis / length[:, None]


def _motors_and_limits(entries: Mapping[str, Any], names: Sequence[str]) -> dict[str, np.ndarray]:
    """Rotor inertias and joint limits."""
    rotor_inertia = _per_joint(entries, "rotor_inertia", len(names), 0.0)
    refuse("rotor_inertia", rotor_inertia, rotor_inertia < 0, "it must not be negative", " kg m^2", names)
    lower = _per_joint(entries, "lower", len(names), -np.inf, finite=False)
    upper = _per_joint(entries, "upper", len(names), np.inf, finite=False)
    refuse("lower", lower, lower >= upper, "it must be below `upper`", " rad", names)
    ask_for_degrees(lower, upper, names)
    return {"rotor_inertia": rotor_inertia, "lower": lower, "upper": upper}


def _add_pairs(fields: dict[str, Any], pairs: Any) -> None:
    """The pairs of capsules to be kept apart, and a note of those left out because they touch."""
    if pairs is not None:
        fields["collision_pairs"] = check_pairs(pairs, fields["capsule_link"])
        return
    fields["collision_pairs"], touching = default_pairs(fields)
    fields["notes"] += _note_of_touching(touching, [fields["link_names"][i] for i in fields["capsule_link"]])


def _note_of_touching(pairs: Sequence[tuple[int, int]], links: Sequence[str]) -> tuple[str, ...]:
    """A note that says how many pairs of capsules touch at rest, and on which links, given each capsule's."""
    between = list(dict.fromkeys(f"{shorten(links[a])} and {shorten(links[b])}" for a, b in pairs))
    if not between:
        return ()
    named = ", ".join(between[:_NAMED])
    more = f", and of {len(between) - _NAMED} more pairs of links" if len(between) > _NAMED else ""
    what = "1 pair of capsules touches" if len(pairs) == 1 else f"{len(pairs)} pairs of capsules touch"
    return (f"{what} at rest, and so not kept apart: of {named}{more}",)
