"""Files damaged bit by bit, and by their grammar, and what comes of reading them.

A damaged file may still be a file: then what was read has to make sense. What a version of reojax cannot read is left
out, so that two versions can be compared.
"""

import io
import json
import random
import re
import tempfile
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr
from pathlib import Path
from typing import Any

import numpy as np

import reojax

ROBOT = reojax.robots.prototype()
CSV = "time,twist1_rad,bend_rad,twist2_rad,qw,qx,qy,qz\n" + "".join(f"{k},0.{k},0,0,1,0,0,0\n" for k in range(6))
URDF = """<?xml version="1.0"?><robot name="r"><link name="a"><inertial><origin xyz="0 0 0.1" rpy="0 0 0"/>
<mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial><collision><geometry>
<cylinder radius="0.1" length="0.3"/></geometry></collision></link><link name="b"><inertial><mass value="2"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link><joint name="j" type="revolute">
<parent link="a"/><child link="b"/><axis xyz="0 0 1"/><origin xyz="0 0 0.3" rpy="0 1 0"/>
<limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
MJCF = """<mujoco model="m"><compiler angle="degree"/><worldbody><body name="a"><freejoint/>
<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/><geom type="capsule" size="0.1 0.2"/><body name="b" pos="0 0 0.3">
<joint name="j" axis="0 0 1" range="-60 60" armature="0.01"/><inertial pos="0 0 0.1" mass="2" diaginertia="1 1 1"/>
</body></body></worldbody><actuator><motor joint="j" gear="10"/></actuator></mujoco>"""
PIECES = [b'"', b"\n", b"\0", b"1e999", b"nan", b"-", b"\xff", b";", b"\r", b"9" * 400, b"{", b"]", b"<", b"&x;", b"-0"]
JSON = [None, True, -1, 0, 2**70, 1e308, "", "x", "nan", [], {}, [[]], [1e999], "x" * 5000, ["a"], {"a": 1}]


def damaged(good: bytes, draw: random.Random) -> bytes:
    """With one to three places changed: bits, bytes, cuts, doublings, and pieces that mean something."""
    data = bytearray(good)
    for _ in range(draw.randrange(1, 4)):
        place, kind = draw.randrange(len(data)), draw.randrange(7)
        if kind < 2:
            data[place] ^= 1 << draw.randrange(8)
        elif kind == 2:
            data[place] = draw.choice([draw.randrange(256), *b"0123456789"])
        elif kind == 3:
            del data[place : place + draw.randrange(1, 20)]
        elif kind == 4:
            data[place:place] = data[max(0, place - 30) : place]
        elif kind == 5:
            del data[place:]
        else:
            data[place:place] = draw.choice(PIECES)
        data = data or bytearray(b"x")
    return bytes(data)


def by_grammar(good: bytes, draw: random.Random) -> bytes:
    """JSON with an entry replaced, dropped or doubled; XML and tables with a number or a name replaced."""
    if good.lstrip()[:1] == b"{":
        tree = json.loads(good)
        here: Any = tree
        while True:
            key = draw.choice([*here] if isinstance(here, dict) else range(len(here)))
            if isinstance(here[key], dict | list) and here[key] and draw.random() < 0.7:
                here = here[key]
                continue
            if draw.random() < 0.2:
                del here[key]
            else:
                here[key] = draw.choice(JSON)
            return json.dumps(tree).encode()
    words = [*re.finditer(rb"[\w.+-]+", good)]
    word = draw.choice(words)
    other = draw.choice([*PIECES, draw.choice(words)[0], b"0", b"-1", b"1e308", b"x" * 3000, b""])
    return good[: word.start()] + other + good[word.end() :]


def _capture(path: Path) -> None:
    capture = reojax.read_capture(path, ROBOT)
    if not (np.isfinite(capture.time).all() and (np.diff(capture.time) > 0).all()):
        raise RuntimeError("times that do not increase")


def _robot(path: Path) -> None:
    """What was read must be a robot that `make_robot` takes."""
    robot = reojax.load_robot(path)
    entries = ("mass", "com", "inertia", "axis", "anchor", "parent", "rotor_inertia", "gear_ratio", "rotor_on", "lower")
    again = reojax.make_robot(**{entry: getattr(robot, entry) for entry in (*entries, "upper")})
    if not np.isfinite(np.sum(again.inertia)):
        raise RuntimeError("a robot of numbers that are none")


def _plan(path: Path) -> None:
    plan = reojax.load_plan(path)
    turned = np.asarray(plan.rotation)
    if not np.abs(turned.T @ turned - np.eye(3)).max() < 1e-4:
        raise RuntimeError("a rotation that is none")


def _store(path: Path) -> None:
    try:
        merged = reojax.merge(path.parent)
    except AttributeError:
        from reojax.sweep import merge

        merged = merge(path.parent)
    missing = getattr(merged, "missing", ())
    found = {key: np.asarray(value) for key, value in merged.results.items()}
    if not len(missing) and not np.array_equal(found["b"], 2 * np.arange(6.0)):
        raise RuntimeError("results that differ")


def subjects(kind: str) -> dict[str, tuple[str, bytes, Callable[[Path], None]]]:
    """Name of a file, what is in it, and what reads it, for a kind and for those that are made on the way."""
    found: dict[str, tuple[str, bytes, Callable[[Path], None]]] = {"captures": ("c.csv", CSV.encode(), _capture)}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        if hasattr(reojax, "load_robot"):
            reojax.save_robot(ROBOT, place / "r.json")
            found["robots, JSON"] = ("r.json", (place / "r.json").read_bytes(), _robot)
            found["robots, URDF"] = ("r.urdf", URDF.encode(), _robot)
            found["robots, MJCF"] = ("r.xml", MJCF.encode(), _robot)
        if hasattr(reojax, "load_plan") and kind == "plans":
            turn = reojax.net_rotation(ROBOT, reojax.manoeuvre_a(1.0, 0.5))
            plan = reojax.plan(ROBOT, turn, twist_limit=1.5, bend_limit=1.0, max_manoeuvres=1)
            reojax.save_plan(plan, place / "p.json", robot=ROBOT)
            found["plans"] = ("p.json", (place / "p.json").read_bytes(), _plan)
        with redirect_stderr(io.StringIO()):  # its bar
            reojax.sweep(lambda a: {"b": a * 2}, {"a": np.arange(6.0)}, store=place / "s", chunk_size=3)
        for file in sorted((place / "s").iterdir()):
            of = "sweeps, manifests" if file.suffix == ".json" else "sweeps, chunks"
            found.setdefault(of, (file.name, file.read_bytes(), _store))
        STORE.update({file.name: file.read_bytes() for file in (place / "s").iterdir()})
    return found


STORE: dict[str, bytes] = {}
"""The files of a store that is whole."""


def files(
    name: str, good: bytes, read: Callable[[Path], None], draw: random.Random
) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Damaged files without end."""
    while True:
        data = damaged(good, draw) if draw.random() < 0.5 else by_grammar(good, draw)
        where = next((k for k, (a, b) in enumerate(zip(data, good, strict=False)) if a != b), min(len(data), len(good)))
        shown = f"{name} from {where} on: {data[where : where + 60]!r}"
        yield shown, lambda data=data: _read(name, data, read)


def _read(name: str, data: bytes, read: Callable[[Path], None]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        if read is _store:
            for other, whole in STORE.items():
                (Path(folder) / other).write_bytes(whole)
        (Path(folder) / name).write_bytes(data)
        read(Path(folder) / name)
