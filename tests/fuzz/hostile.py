"""Hostile input for public functions, files and command lines, and what came of it.

An input is *refused by name* by a `ValueError` of at most `LONGEST` characters (of the command line: status 2 and one
line), *fine* if every number that comes back is finite, and *wrong* otherwise: another exception, a number that is
none, or a message without end.
"""

import datetime
import io
import json
import math
import random
import sys
import tempfile
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

import reojax
from reojax.cli import main

LONGEST = 2000
SLOWEST = 60.0
"""Most processor time of one input [s], compiling included."""
PROTOTYPE = reojax.robots.prototype()
PATH = reojax.manoeuvre_a(1.0, 0.5)
TRAJECTORY = reojax.along(PATH, "quintic", 0.2)
TIME = np.linspace(0, 1, 12)
CAPTURE = reojax.make_capture(TIME, np.zeros((12, 3)), np.broadcast_to(np.eye(3), (12, 3, 3)))
MOTION = reojax.simulate(PROTOTYPE, PATH, durations=0.2, samples=16)
NO_JOINTS = reojax.make_robot(
    mass=[1.0], com=np.zeros((1, 3)), inertia=[np.eye(3)], axis=np.zeros((0, 3)), anchor=np.zeros((0, 3))
)

VALUES: list[Any] = [
    None, True, False, 0, 1, -1, 3, 2**70, -(2**70), 0.0, -0.0, 0.5, -0.5, 1e-300, 1e308, -1e308, math.nan, math.inf,
    -math.inf, 1j, "", "x", "0.5", "x" * 10**5, b"x", [], [0.1], [0.1, 0.2, 0.3], [0.1, math.nan, 0.3],
    ["a", "b", "c"], {}, {"a": 1}, (), object(), print, np.float16(0.5), np.longdouble(0.5), np.timedelta64(5, "ms"),
    datetime.timedelta(seconds=1), np.zeros((2, 3)), np.zeros((2, 0)), np.zeros(0), np.full((2, 3), np.nan), np.eye(3),
    2 * np.eye(3), -np.eye(3), np.eye(3, dtype=bool), np.zeros((5, 3, 3)), np.ma.masked_array([1.0, 2.0], [1, 0]),
    jnp.ones(3, jnp.bfloat16), np.array(["1"]), np.ones((2, 3), np.float32), PROTOTYPE, NO_JOINTS, PATH, TRAJECTORY,
    CAPTURE, MOTION, reojax.RE_MAX_17, reojax.Release(), Path("/nowhere/x.csv"), "/dev/null", "/dev/full",
]  # fmt: skip
"""What is put in the place of an argument."""

CALLS: dict[str, tuple[Callable[..., Any], dict[str, Any]]] = {
    "polygon": (reojax.polygon, {"waypoints": np.zeros((2, 3))}),
    "manoeuvre_a": (reojax.manoeuvre_a, {"twist": 1.0, "bend": 0.5}),
    "net_rotation": (reojax.net_rotation, {"robot": PROTOTYPE, "path": PATH, "steps": 2}),
    "rotation_history": (reojax.rotation_history, {"robot": PROTOTYPE, "path": PATH, "samples": 4}),
    "connection": (reojax.connection, {"robot": PROTOTYPE, "theta": np.zeros(3)}),
    "along": (reojax.along, {"path": PATH, "law": "quintic", "durations": 0.2}),
    "through": (reojax.through, {"path": PATH, "durations": 0.2}),
    "trapezoid": (reojax.trapezoid, {"ramp": 0.3}),
    "minimum_jerk": (reojax.minimum_jerk, {"times": [0.5], "places": [0.5]}),
    "simulate": (
        reojax.simulate,
        {"robot": PROTOTYPE, "path": PATH, "law": "quintic", "durations": 0.2, "motors": None, "momentum": None,
         "samples": 16, "substeps": None},
    ),
    "released": (
        reojax.released,
        {"robot": PROTOTYPE, "trajectory": TRAJECTORY, "release": reojax.Release(), "steps": 4, "substeps": None},
    ),
    "release.momentum": (
        lambda momentum, drag: reojax.released(PROTOTYPE, TRAJECTORY, reojax.Release(momentum, drag=drag), samples=4),
        {"momentum": (0.0, 0.0, 1e-4), "drag": 1e-6},
    ),
    "minimum_time": (
        reojax.minimum_time,
        {"robot": PROTOTYPE, "path": PATH, "motors": reojax.RE_MAX_17, "law": "quintic", "samples": 16},
    ),
    "with_motors": (reojax.with_motors, {"robot": PROTOTYPE, "motors": reojax.RE_MAX_17}),
    "gains": (reojax.gains, {"robot": PROTOTYPE, "bandwidth": 100.0, "theta": None}),
    "track": (
        reojax.track,
        {"robot": PROTOTYPE, "trajectory": TRAJECTORY, "motors": reojax.RE_MAX_17,
         "gains": reojax.gains(PROTOTYPE, 50.0), "sample_time": 5e-3, "counts": 512.0, "settle": 0.0, "momentum": None,
         "model": None, "substeps": 1},
    ),
    "make_capture": (
        reojax.make_capture, {"time": TIME, "theta": np.zeros((12, 3)), "rotation": None}
    ),
    "compare": (reojax.compare, {"robot": PROTOTYPE, "capture": CAPTURE, "motion": MOTION, "offset": 0.0}),
    "calibrate": (
        reojax.calibrate,
        {"robot": PROTOTYPE, "capture": CAPTURE, "parameters": ("end_inertia",), "clock": True, "joint_noise": None,
         "max_steps": 2},
    ),
    "read_capture": (reojax.read_capture, {"path": "/nowhere", "robot": PROTOTYPE, "angle_unit": None}),
    "write_trajectory": (
        lambda path, time, t, delay: reojax.write_trajectory(path, PROTOTYPE, time, t, t, t, delay=delay),
        {"path": "/nowhere/x.csv", "time": TIME, "t": np.zeros((12, 3)), "delay": 0.0},
    ),
    "merge": (reojax.merge, {"folders": "/nowhere"}),
    "make_robot": (
        reojax.make_robot,
        {"mass": [1.0, 1.0], "com": np.zeros((2, 3)), "inertia": [np.eye(3)] * 2, "axis": [[0, 0, 1.0]],
         "anchor": np.zeros((1, 3)), "lower": [-1.0], "upper": [1.0], "rotor_on": None, "name": "r"},
    ),
}  # fmt: skip
"""Public functions with arguments that are right."""


class Tally(Counter[str]):
    """How many inputs were tried, and what came of them; `found` has the wrong ones."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def judge(self, what: str, call: Callable[[], Any]) -> None:
        """Try one input; what takes long is wrong too, and told at once."""
        self["tried"] += 1
        begin = time.process_time()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                verdict = self._finite(call())
        except ValueError as refusal:
            long = len(str(refusal)) > LONGEST
            verdict = f"a message of {len(str(refusal))} characters" if long else "refused by name"
        except Exception as error:
            verdict = f"{type(error).__name__}: {str(error)[:150]}"
        if (took := time.process_time() - begin) > SLOWEST:
            verdict = f"{took:.0f} s, then {verdict}"
            print(f"{what}: {verdict}", file=sys.__stderr__)
        if verdict in ("fine", "refused by name"):
            self[verdict] += 1
        else:
            self["wrong"] += 1
            self.found.append(f"{what}: {verdict}")

    @staticmethod
    def _finite(result: Any) -> str:
        numbers = [np.asarray(x) for x in jax.tree.leaves(result) if isinstance(x, float | np.ndarray | jax.Array)]
        if isinstance(result, reojax.Comparison):  # NaN is what was not measured
            numbers = [np.asarray(result.offset), result.simulated_theta, result.simulated_rotation]
        bad = [x for x in numbers if x.dtype.kind == "f" and np.isnan(x).any()]
        return "a number that is none" if bad else "fine"

    def __str__(self) -> str:
        return ", ".join(f"{self[kind]} {kind}" for kind in ("tried", "refused by name", "fine", "wrong"))


def hostile_calls(draw: random.Random | None = None) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Every argument of every function replaced by every value; or without end by random values, one or two at once."""
    if draw is None:
        for name, (function, arguments) in CALLS.items():
            for entry in arguments:
                for value in VALUES:
                    yield _call(name, function, arguments, {entry: value})
    while draw is not None:
        name = draw.choice(list(CALLS))
        function, arguments = CALLS[name]
        entries = draw.sample(list(arguments), min(len(arguments), draw.choice([1, 2])))
        yield _call(name, function, arguments, {entry: draw.choice(VALUES) for entry in entries})


def _call(name: str, function: Callable[..., Any], right: dict, wrong: dict) -> tuple[str, Callable[[], Any]]:
    shown = ", ".join(f"{entry}={repr(value)[:60]}" for entry, value in wrong.items())
    arguments = right | wrong
    if name == "merge":
        return f"{name}({shown})", lambda: function(arguments["folders"]).results
    return f"{name}({shown})", lambda: function(**arguments)


WORDS = [
    "", "a", "b", "-1", "1e9", "nan", "inf", "x", "0", "0.5", "1,2", "1,2,3,4", "-0.001,0,0", "/dev/full", "/nowhere/a",
    "prototype", "planar2", "six_body", "quintic", "trapezoid", "a.png", "a.csv", "a.npz", "twist=0:1:2", "twist=1,2",
    "gear=0,1", "roll", "--", "-h", "x" * 5000, "é°\udc80", "3deg", "[", "rotvec 0 90 0", "rotvec",
]  # fmt: skip
OPTIONS = """--robot --manoeuvre --twist --bend --law --duration --supply --momentum --json --out --picture --rate
--delay --torques --angles --offset --calibrate --shard --store --chunk-size --devices --outputs --plan --html
--target""".split()
COMMANDS = ["simulate", "time", "compare", "export", "sweep", "merge"]


def hostile_lines(draw: random.Random) -> Iterator[tuple[list[str], Callable[[], Any]]]:
    """Command lines without end, of real options and hostile words."""
    while True:
        line = [draw.choice(COMMANDS)]
        for _ in range(draw.randrange(1, 5)):
            line.append(draw.choice(OPTIONS) if draw.random() < 0.5 else draw.choice(WORDS))
        yield line, lambda line=line: run_line(line)


def run_line(line: list[str]) -> None:
    """Run a command line; a refusal is a `ValueError`, and anything else but success, is an error."""
    printed, complaint = io.StringIO(), io.StringIO()
    with redirect_stdout(printed), redirect_stderr(complaint):
        status = main(line)
    said = complaint.getvalue()
    if status == 2 and said.count("\n") == 1 and not printed.getvalue():
        raise ValueError(said)
    if status not in (0, 1) or "nan" in printed.getvalue().lower().split():
        raise RuntimeError(f"status {status}: {said[:200]} {printed.getvalue()[:200]}")


CSV = "time,twist1_rad,bend_rad,twist2_rad,qw,qx,qy,qz\n" + "".join(f"{k},0.{k},0,0,1,0,0,0\n" for k in range(6))


def hostile_files(draw: random.Random) -> Iterator[tuple[str, Callable[[], Any]]]:
    """Captures without end, with bytes changed, cut, doubled and put in."""
    while True:
        data = bytearray(CSV.encode())
        for _ in range(draw.randrange(1, 4)):
            place = draw.randrange(len(data))
            kind = draw.choice([0, 0, 0, 1, 2, 3])
            if kind == 0:
                data[place] = draw.choice([draw.randrange(256), *b"0123456789"])
            elif kind == 1:
                del data[place : place + draw.randrange(1, 20)]
            elif kind == 2:
                data[place:place] = data[max(0, place - 30) : place]
            else:
                data[place:place] = draw.choice(
                    [b'"', b"\n", b"\0", b"1e999", b"nan", b"-", b"\xff", b";", b"\r", b"9" * 400]
                )
            data = data or bytearray(b"x")
        yield repr(bytes(data[:80])), lambda data=bytes(data): _read(data)


def _read(data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "c.csv"
        file.write_bytes(data)
        capture = reojax.read_capture(file, PROTOTYPE)
    if not (np.isfinite(capture.time).all() and (np.diff(capture.time) > 0).all()):
        raise RuntimeError("times that do not increase")


def report(tallies: dict[str, Tally]) -> str:
    """A table of what was tried, and what was wrong."""
    lines = [f"{name}: {tally}" for name, tally in tallies.items()]
    return "\n".join([*lines, *(f"WRONG {text}" for tally in tallies.values() for text in sorted(set(tally.found)))])


def as_json(tallies: dict[str, Tally]) -> str:
    """The same as JSON."""
    return json.dumps({name: dict(tally) for name, tally in tallies.items()})
