"""The door of `Robot.replace`: what takes a field's place has its shape and its kind; traced numbers pass."""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from reojax._internal.arrays import refuse_lookalikes
from reojax._internal.checks import listing, refuse, shorten

_FREE = ("collision_pairs", "couplings", "layout", "notes")
"""Static fields that may change in length."""
_NOT_NEGATIVE = ("mass", "rotor_inertia", "capsule_radius")


def replacement(robot: Any, key: str, value: Any) -> Any:
    """Return what takes the place of the field `key`.

    Raises:
        ValueError: for another shape, or what is no such thing at all.
    """
    old = getattr(robot, key)
    if isinstance(old, str):
        if not isinstance(value, str):
            raise ValueError(f"`{key}` is {shorten(value)}; it must be a string.")
        return value
    if key in _FREE:
        return value if key == "layout" else tuple(listing(key, value, "its entries"))
    if isinstance(old, tuple):
        return _names_or_numbers(robot, key, value, old)
    given = value
    refuse_lookalikes(key, value)
    if not hasattr(value, "shape"):
        try:
            value = jnp.asarray(value) if _on_device(value) else np.asarray(value)
        except (TypeError, ValueError):
            raise ValueError(f"`{key}` is {shorten(value)}; it must be an array of real numbers.") from None
    if not (jnp.issubdtype(value.dtype, np.floating) or jnp.issubdtype(value.dtype, np.integer)):
        if value.dtype != jax.dtypes.float0:  # the derivative of an integer
            raise ValueError(f"`{key}` is {shorten(given)}; it must be an array of real numbers.")
    if value.shape != old.shape:
        raise ValueError(f"`{key}` has shape {value.shape}; on this robot it must be {old.shape}.")
    if isinstance(value, np.ndarray):
        if jnp.issubdtype(value.dtype, np.integer):
            value = value.astype(float)
        names = robot.joint_names if key == "rotor_inertia" else robot.link_names if key == "mass" else ()
        refuse(key, value, np.isnan(value), "it must be a number", names=names)
        if key in _NOT_NEGATIVE and value.ndim == 1:
            refuse(key, value, value < 0, "it must not be negative", names=names)
    return value


def _on_device(value: Any) -> bool:
    return any(isinstance(leaf, jax.Array) for leaf in jax.tree.leaves(value))


def _names_or_numbers(robot: Any, key: str, value: Any, old: tuple) -> tuple:
    if isinstance(value, str) or not hasattr(value, "__iter__"):
        raise ValueError(f"`{key}` is {shorten(value)}; it must list {len(old)} entries.")
    items = tuple(value)
    if len(items) != len(old):
        raise ValueError(f"`{key}` has shape {(len(items),)}; on this robot it must be {(len(old),)}.")
    for k, item in enumerate(items):
        if key == "rotor_on" and item not in ("parent", "child"):
            raise ValueError(f"rotor_on[{k}] is {shorten(item)}; it must be 'parent' or 'child'.")
        if key in ("link_names", "joint_names") and (not isinstance(item, str) or not item or item in items[:k]):
            raise ValueError(f"{key}[{k}] is {shorten(item)}; names are strings that differ.")
        if key in ("parent", "capsule_link"):
            most = k if key == "parent" else robot.links - 1
            if isinstance(item, bool) or not isinstance(item, int | np.integer) or not 0 <= item <= most:
                raise ValueError(f"{key}[{k}] is {shorten(item)}; it must be a link, an integer from 0 to {most}.")
    return tuple(int(item) for item in items) if key in ("parent", "capsule_link") else items
