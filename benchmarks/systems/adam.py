"""adam: the mass matrix at every node, in batches of its own (under `vmap` it fails), fourth-order Magnus method.

adam makes its models of text, so the end links keep the inertia of the thesis here, and the error is counted against
reojax with the same; the other three variables are those of the task.
"""

from collections.abc import Iterator
from functools import partial
from xml.etree.ElementTree import Element, SubElement, tostring

import jax
import jax.numpy as jnp
import numpy as np

from reojax import Robot, interop
from reojax.robots import prototype
from reojax.robots.prototype import END_INERTIA

from . import _jax_rows, _magnus
from ._foreign import omega_from_base_rows
from ._rows import Row, optional
from ._task import Loops, Reference, Task, objective

PACKAGE = "adam-robotics, without its extra `jax` (that one goes back to JAX 0.6.0)"
VARIABLES = ("twist", "bend", "ratio")


def rows(task: Task) -> Iterator[Row]:
    """Rows of `KinDynComputations.mass_matrix`."""
    adam = optional("adam.jax", PACKAGE)
    loops = task.loops._replace(inertia=np.full_like(task.loops.inertia, END_INERTIA))
    task = task._replace(loops=loops, reference=Reference(loops, task.checked))
    robot = prototype()
    rotors = list(interop.rotors(robot))
    computations = adam.KinDynComputations(_urdf(robot), [*robot.joint_names, *(f"rotor{r.joint}" for r in rotors)])
    turns = np.zeros((len(rotors), 3))
    for index, rotor in enumerate(rotors):
        turns[index, rotor.joint] = np.sign(rotor.spin)

    def rotations(loops: Loops) -> jax.Array:
        theta, rate = jax.vmap(partial(_magnus.traced_nodes, steps=task.magnus_steps))(loops)
        drive = jnp.concatenate(jnp.broadcast_arrays(jnp.eye(3), loops.ratio[:, None, None] * turns), axis=1)
        q, velocity = (jnp.einsum("nhj,nij->nih", drive, x) for x in (theta, rate))
        base = jnp.broadcast_to(jnp.eye(4), (*q.shape[:2], 4, 4)).reshape(-1, 4, 4)
        mass = computations.mass_matrix(base, q.reshape(-1, q.shape[-1])).reshape(*q.shape[:2], 12, 12)
        push = jnp.einsum("niab,nib->nia", mass[:, :, :6, 6:], velocity)
        return jax.vmap(_magnus.traced_product)(jax.vmap(jax.vmap(omega_from_base_rows))(mass[:, :, :6, :6], push))

    def gradients(loops: Loops) -> tuple[jax.Array, list[jax.Array]]:
        def number(moving: list[jax.Array]) -> tuple[jax.Array, jax.Array]:
            values = objective(rotations(loops._replace(**dict(zip(VARIABLES, moving, strict=True)))))
            return values.sum(), values  # each loop's gradient is its own: the loops are independent

        slope, values = jax.grad(number, has_aux=True)([getattr(loops, name) for name in VARIABLES])
        return values, slope

    yield from _jax_rows.rows(
        task,
        "adam",
        rotations,
        gradients,
        loops=8 if task.quick else 64,
        steps=task.magnus_steps,
        evaluations=_magnus.evaluations(task.magnus_steps),
        variables=VARIABLES,
        note="end links of the thesis in all loops: adam's models are made of text",
    )


def _urdf(robot: Robot) -> str:
    """Write the robot as URDF, its rotors as bodies without mass."""
    xml, inertia = Element("robot", name=robot.name), np.array(robot.inertia)
    joints = list(zip(robot.joint_names, robot.parent, robot.link_names[1:], robot.axis, robot.anchor, strict=True))
    for rotor in interop.rotors(robot):
        spun = rotor.inertia * np.outer(rotor.axis, rotor.axis)
        inertia[rotor.link] -= spun
        _link(xml, f"wheel{rotor.joint}", 0.0, np.zeros(3), spun)
        joints.append((f"rotor{rotor.joint}", rotor.link, f"wheel{rotor.joint}", rotor.axis, np.zeros(3)))
    for link in zip(robot.link_names, robot.mass, robot.com, inertia, strict=True):
        _link(xml, *link)
    for name, parent, child, axis, anchor in joints:
        joint = SubElement(xml, "joint", name=name, type="continuous")
        SubElement(joint, "parent", link=robot.link_names[parent])
        SubElement(joint, "child", link=child)
        SubElement(joint, "origin", xyz=_text(anchor))
        SubElement(joint, "axis", xyz=_text(axis))
    return tostring(xml, encoding="unicode")


def _link(xml: Element, name: str, mass: float, com: np.ndarray, inertia: np.ndarray) -> None:
    inertial = SubElement(SubElement(xml, "link", name=name), "inertial")
    SubElement(inertial, "mass", value=repr(float(mass)))
    SubElement(inertial, "origin", xyz=_text(com))
    entries = {f"i{'xyz'[a]}{'xyz'[b]}": repr(float(inertia[a, b])) for a in range(3) for b in range(a, 3)}
    SubElement(inertial, "inertia", attrib=entries)


def _text(vector: np.ndarray) -> str:
    return " ".join(repr(float(x)) for x in vector)
