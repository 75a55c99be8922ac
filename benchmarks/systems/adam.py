"""adam: the centroidal momentum matrix at every node, under vmap, fourth-order Magnus method.

adam makes its models of text, so the end links keep the inertia of the thesis here, and the error is counted against
reojax with the same; the other three variables are those of the task.
"""

from collections.abc import Iterator
from xml.etree.ElementTree import Element, SubElement, tostring

import jax
import jax.numpy as jnp
import numpy as np

from reojax import Robot
from reojax.robots import prototype
from reojax.robots.prototype import END_INERTIA

from . import _magnus, _under_vmap
from ._foreign import omega_from_base_rows, oracles
from ._rows import Row, optional
from ._task import Loops, Reference, Task

PACKAGE = "adam-robotics, without its extra `jax` (that one goes back to JAX 0.6.0)"


def rows(task: Task) -> Iterator[Row]:
    """Rows of `KinDynComputations.mass_matrix`."""
    adam = optional("adam.jax", PACKAGE)
    loops = task.loops._replace(inertia=np.full_like(task.loops.inertia, END_INERTIA))
    task = task._replace(loops=loops, reference=Reference(loops, task.checked))
    robot = prototype()
    rotors = list(oracles().rotors(robot))
    computations = adam.KinDynComputations(_urdf(robot), [*robot.joint_names, *(f"rotor{r.joint}" for r in rotors)])
    turns = np.zeros((len(rotors), 3))
    for index, rotor in enumerate(rotors):
        turns[index, rotor.joint] = np.sign(rotor.spin)

    def rotation(loop: Loops) -> jax.Array:
        drive = jnp.concatenate([jnp.eye(3), loop.ratio * turns])

        def omega(theta: jax.Array, rate: jax.Array) -> jax.Array:
            mass = computations.mass_matrix(jnp.eye(4), drive @ theta)
            return omega_from_base_rows(mass[:6, :6], mass[:6, 6:] @ (drive @ rate))

        return _magnus.rotation(omega, loop, task.magnus_steps)

    yield from _under_vmap.rows(
        task,
        "adam",
        rotation,
        loops=8 if task.quick else 64,
        steps=task.magnus_steps,
        evaluations=_magnus.evaluations(task.magnus_steps),
        variables=("twist", "bend", "ratio"),
        note="end links of the thesis in all loops: adam's models are made of text",
    )


def _urdf(robot: Robot) -> str:
    """Write the robot as URDF, its rotors as bodies without mass."""
    xml, inertia = Element("robot", name=robot.name), np.array(robot.inertia)
    joints = list(zip(robot.joint_names, robot.parent, robot.link_names[1:], robot.axis, robot.anchor, strict=True))
    for rotor in oracles().rotors(robot):
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
