"""Equality constraints of a compiled MJCF: which links and joints they tie."""

# pyright: reportAttributeAccessIssue=false

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from reojax._internal.checks import shorten


def constraints_of(
    model: Any, bodies: list[str], joints: list[str], notes: list[str]
) -> Iterator[tuple[str, str, tuple[str, ...], tuple[str, ...]]]:
    """Name, kind, links and joints of each one that is active; `notes` gets the others."""
    import mujoco

    for e in range(model.neq):
        kind = mujoco.mjtEq(int(model.eq_type[e]))
        word = kind.name.removeprefix("mjEQ_").lower()
        name = model.equality(e).name or f"equality{e}"
        if not model.eq_active0[e]:
            notes.append(f"left out: equality constraint {shorten(name)} ({word}), which is not active")
            continue
        ids = [int(model.eq_obj1id[e]), int(model.eq_obj2id[e])]
        if kind in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            if int(model.eq_objtype[e]) == int(mujoco.mjtObj.mjOBJ_SITE):
                ids = [int(model.site_bodyid[i]) for i in ids]
            yield name, word, tuple(bodies[i] for i in ids), ()
        elif kind == mujoco.mjtEq.mjEQ_JOINT:
            yield name, word, (), tuple(joints[i] for i in ids if i >= 0)
        elif kind == mujoco.mjtEq.mjEQ_TENDON:
            yield name, word, *_tendon_ties(model, [i for i in ids if i >= 0], bodies, joints)
        else:  # soft bodies: nothing that locking joints can meet
            yield name, word, (), tuple(joints)


def _tendon_ties(model: Any, tendons: list[int], bodies: list[str], joints: list[str]) -> tuple[tuple, tuple]:
    """Links and joints that tendons run over."""
    import mujoco

    links, tied = [], []
    for tendon in tendons:
        for w in range(model.tendon_adr[tendon], model.tendon_adr[tendon] + model.tendon_num[tendon]):
            kind, i = int(model.wrap_type[w]), int(model.wrap_objid[w])
            if kind == int(mujoco.mjtWrap.mjWRAP_JOINT):
                tied.append(joints[i])
            elif kind == int(mujoco.mjtWrap.mjWRAP_SITE):
                links.append(bodies[int(model.site_bodyid[i])])
    return tuple(links), tuple(tied)
