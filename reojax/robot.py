"""What a robot is: a tree of rigid links joined by revolute joints, each with a geared motor.

Link 0 is the base (link 1 of the thesis). Joint `k` carries link `k + 1` and hangs from link
`parent[k] <= k`. All link frames are parallel when every joint angle is zero; the frame of link
`k + 1` has its origin on joint `k`. SI units throughout.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import jax
import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from reojax._internal.arrays import Array, is_concrete
from reojax._internal.checks import did_you_mean, instance
from reojax._internal.entries import Entries
from reojax._internal.replacements import replacement
from reojax._internal.robot_checks import check_entries
from reojax._internal.robot_table import one_line, table
from reojax.capsules import Capsule
from reojax.manoeuvres import Layout, check_layout

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
    capsule_start: Float[Array, "c 3"]
    """First end of each capsule's centre line, in the frame of the link that carries it [m]."""
    capsule_end: Float[Array, "c 3"]
    """Second end, likewise; a sphere where it equals the first [m]."""
    capsule_radius: Float[Array, " c"]
    """Radii of the capsules [m]."""
    coupling_ratio: Float[Array, " d"]
    """Of each coupled (mimic) joint: `theta[joint] = ratio * theta[driver] + offset`."""
    coupling_offset: Float[Array, " d"]
    """Likewise [rad]."""
    parent: tuple[int, ...] = _static()
    """Link that each joint hangs from."""
    rotor_on: tuple[Side, ...] = _static()
    """Link that carries each motor's stator."""
    link_names: tuple[str, ...] = _static()
    joint_names: tuple[str, ...] = _static()
    name: str = _static()
    capsule_link: tuple[int, ...] = _static()
    """Link that carries each capsule."""
    collision_pairs: tuple[tuple[int, int], ...] = _static()
    """Pairs of capsules that must stay clear of each other."""
    couplings: tuple[tuple[int, int], ...] = _static()
    """Coupled joints, each with its driver, which is a joint that is not coupled itself."""
    layout: Layout | None = _static()
    """Which joints twist, bend and fold in manoeuvres A and B; None for a robot that has no such parts."""
    notes: tuple[str, ...] = _static()
    """What was merged, locked, dropped or assumed when the robot was read from a file or built."""

    @property
    def links(self) -> int:
        """Number of links, `n`."""
        return len(self.parent) + 1

    @property
    def joints(self) -> int:
        """Number of joints, `j = n - 1`."""
        return len(self.parent)

    @property
    def capsules(self) -> tuple[Capsule, ...]:
        """The shapes that links are taken to have, for clearance and for pictures."""
        return tuple(
            Capsule(link, start, end, radius)
            for link, start, end, radius in zip(
                self.capsule_link, self.capsule_start, self.capsule_end, self.capsule_radius, strict=True
            )
        )

    def __post_init__(self) -> None:
        for field, value in vars(self).items():
            if type(value) is np.ndarray:
                object.__setattr__(self, field, value.view(Entries))

    def __eq__(self, other: object) -> bool:
        """Equal where structure, names and all bits of all numbers are."""
        if not isinstance(other, Robot):
            return NotImplemented
        if self is other:
            return True
        mine, its = jax.tree.flatten(self), jax.tree.flatten(other)
        if mine[1] != its[1] or not is_concrete((mine[0], its[0])):
            return False
        return all(_bits(x) == _bits(y) for x, y in zip(mine[0], its[0], strict=True))

    def __hash__(self) -> int:
        """Of what never changes under tracing, and of the masses' bits."""
        masses = _bits(self.mass) if is_concrete(self.mass) and hasattr(self.mass, "dtype") else id(self.mass)
        return hash((self.name, self.parent, self.joint_names, masses))

    def replace(self, **fields: Any) -> "Robot":
        """Return a copy with some fields changed.

        Takes traced values, so that it can sit inside `vmap` and `grad`; only names, shapes and kinds are checked
        (of numbers on the host also that none is NaN and no mass or rotor inertia negative), not what `make_robot`
        checks beyond. Static fields (`parent`, `rotor_on`, names, `capsule_link`) keep their lengths.

        Raises:
            ValueError: for a field that a robot does not have, or a wrong shape or kind.
        """
        known = {field.name for field in dataclasses.fields(self)}
        for key, value in fields.items():
            if key not in known:
                raise ValueError(
                    f"a robot has no field {key!r}; its fields are {', '.join(sorted(known))}."
                    + did_you_mean(key, known)
                )
            fields[key] = replacement(self, key, value)
            if key == "layout" and value is not None:
                check_layout(value)
        return dataclasses.replace(self, **fields)

    def __repr__(self) -> str:
        return one_line(self)

    def __str__(self) -> str:
        return table(self)


def _bits(array: Any) -> tuple[Any, ...]:
    host = np.asarray(array)
    return host.dtype, host.shape, host.tobytes()


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
    capsules: Sequence[Capsule] = (),
    collision_pairs: Sequence[tuple[int, int]] | None = None,
    couplings: Mapping[int | str, tuple[int | str, float, float]] | None = None,
    layout: Layout | None = None,
    notes: Sequence[str] = (),
) -> Robot:
    """Build a robot from plain numbers, and refuse what no robot can have.

    Args:
        mass: (n,) link masses [kg], not negative.
        com: (n, 3) centres of mass, each in its link's own frame [m].
        inertia: (n, 3, 3) about each centre of mass, in the link's own frame [kg m^2]; symmetric,
            no principal moment negative, and none larger than the sum of the other two. Massless links, point
            masses and thin rods are legal where the whole robot has kinetic energy in every motion of base and joints.
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
        capsules: shapes of the links, any number each, for clearance and for pictures.
        collision_pairs: pairs of numbers of capsules that must stay clear of each other; default all whose links are
            neither the same nor joined directly, and that do not touch at `theta = 0`.
        couplings: joint -> (driver, ratio, offset [rad]) for joints that follow another one,
            `theta[joint] = ratio * theta[driver] + offset`; joints by number or name.
        layout: which joints twist, bend and fold in manoeuvres; default none.
        notes: what should be told about where the numbers come from.

    Raises:
        ValueError: naming the entry, its value and the rule it breaks.
    """
    if layout is not None:
        check_layout(layout)
    return Robot(
        **check_entries(
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
            capsules=capsules,
            collision_pairs=collision_pairs,
            couplings=couplings,
            layout=layout,
            notes=notes,
        )
    )


def layout_of(robot: Robot) -> Layout:
    """Return the robot's own layout; it is never guessed.

    Raises:
        ValueError: if it has none.
    """
    instance("robot", robot, Robot, "`make_robot` makes")
    if robot.layout is None:
        raise ValueError(
            f"{robot.name!r} has no layout of its own: pass `layout=Layout(joints, twist, bend)` that names its twist "
            "pair and its bend joint, or use `free_path`, which needs none."
        )
    return robot.layout
