"""What a robot is: a tree of rigid links joined by revolute joints, each with a geared motor.

Link 0 is the base (link 1 of the thesis). Joint `k` carries link `k + 1` and hangs from link
`parent[k] <= k`. All link frames are parallel when every joint angle is zero; the frame of link
`k + 1` has its origin on joint `k`. SI units throughout.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, Literal

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array
from reojax._internal.robot_checks import check_robot

Side = Literal["parent", "child"]


def _static() -> Any:
    return dataclasses.field(metadata={"static": True})


@jax.tree_util.register_dataclass
@dataclasses.dataclass(frozen=True, eq=False)
class Robot:
    """A free-floating tree of `n` links and `j = n - 1` revolute joints; built by `make_robot`.

    An immutable pytree: the arrays are leaves, so `jax.grad` with respect to a robot gives a
    robot; structure and names are static.
    """

    mass: Float[Array, " n"]
    """Link masses [kg]."""
    com: Float[Array, "n 3"]
    """Centre of mass of each link in the link's own frame [m]."""
    inertia: Float[Array, "n 3 3"]
    """Inertia about each link's centre of mass, in the link's own frame [kg m^2]."""
    axis: Float[Array, "j 3"]
    """Joint axes; `theta[k]` turns the child about `axis[k]`, right-handed. Only the direction counts."""
    anchor: Float[Array, "j 3"]
    """Position of each joint in its parent link's frame [m]."""
    rotor_inertia: Float[Array, " j"]
    """Inertia of each motor's rotor about its spin axis, which is parallel to the joint's [kg m^2]."""
    gear_ratio: Float[Array, " j"]
    """Rotor turns per joint turn."""
    lower: Float[Array, " j"]
    """Lower joint limits [rad]."""
    upper: Float[Array, " j"]
    """Upper joint limits [rad]."""
    parent: tuple[int, ...] = _static()
    """Link that each joint hangs from."""
    rotor_on: tuple[Side, ...] = _static()
    """Link that carries each motor's stator."""
    link_names: tuple[str, ...] = _static()
    joint_names: tuple[str, ...] = _static()
    name: str = _static()

    @property
    def links(self) -> int:
        """Number of links, `n`."""
        return len(self.parent) + 1

    @property
    def joints(self) -> int:
        """Number of joints, `j = n - 1`."""
        return len(self.parent)

    def replace(self, **fields: Any) -> "Robot":
        """Return a copy with some fields changed.

        Takes traced values, so that it can sit inside `vmap` and `grad`; only names and shapes are
        checked. Static fields (`parent`, `rotor_on`, names) keep their lengths.

        Raises:
            ValueError: for a field that a robot does not have, or a wrong shape.
        """
        known = {field.name for field in dataclasses.fields(self)}
        for key, value in fields.items():
            if key not in known:
                raise ValueError(f"a robot has no field {key!r}; its fields are {', '.join(sorted(known))}.")
            old = getattr(self, key)
            if isinstance(old, str):
                continue
            if isinstance(old, tuple):
                fields[key] = tuple(value)
                shape, expected = (len(fields[key]),), (len(old),)
            else:
                fields[key] = value if hasattr(value, "shape") else np.asarray(value, float)
                shape, expected = fields[key].shape, old.shape
            if shape != expected:
                raise ValueError(f"`{key}` has shape {shape}; on this robot it must be {expected}.")
        return dataclasses.replace(self, **fields)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, {self.links} links, joints {', '.join(self.joint_names)})"


def make_robot(
    *,
    mass: ArrayLike,
    com: ArrayLike,
    inertia: ArrayLike,
    axis: ArrayLike,
    anchor: ArrayLike,
    parent: Sequence[int] | None = None,
    rotor_inertia: ArrayLike | None = None,
    gear_ratio: ArrayLike | None = None,
    rotor_on: Sequence[Side] | None = None,
    lower: ArrayLike | None = None,
    upper: ArrayLike | None = None,
    link_names: Sequence[str] | None = None,
    joint_names: Sequence[str] | None = None,
    name: str = "robot",
) -> Robot:
    """Build a robot from plain numbers, and refuse what no robot can have.

    Args:
        mass: (n,) link masses [kg], positive.
        com: (n, 3) centres of mass, each in its link's own frame [m].
        inertia: (n, 3, 3) about each centre of mass, in the link's own frame [kg m^2]; symmetric,
            principal moments positive and none larger than the sum of the other two.
        axis: (j, 3) joint axes, unit length.
        anchor: (j, 3) joint positions in the parent link's frame [m].
        parent: (j,) link each joint hangs from, `parent[k] <= k`; default a serial chain 0, 1, 2, ...
        rotor_inertia: (j,) motor rotor inertia about its spin axis [kg m^2]; default 0. The rotor's mass
            and its inertia as part of the stator's link belong in `mass`, `com` and `inertia`.
        gear_ratio: (j,) rotor turns per joint turn; default 1.
        rotor_on: (j,) of "parent" or "child", the link that carries the stator; default "parent". The rotor
            spins relative to its stator at `+gear_ratio * theta_dot` about `axis` on the parent, `-` on the child.
        lower: (j,) lower joint limits [rad]; default none.
        upper: (j,) upper joint limits [rad]; default none.
        link_names: (n,) names, distinct.
        joint_names: (j,) names, distinct.
        name: the robot's name.

    Raises:
        ValueError: naming the entry, its value and the rule it breaks.
    """
    return Robot(
        **check_robot(
            mass=mass,
            com=com,
            inertia=inertia,
            axis=axis,
            anchor=anchor,
            parent=parent,
            rotor_inertia=rotor_inertia,
            gear_ratio=gear_ratio,
            rotor_on=rotor_on,
            lower=lower,
            upper=upper,
            link_names=link_names,
            joint_names=joint_names,
            name=name,
        )
    )
