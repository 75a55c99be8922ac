"""Gains as files for a microcontroller: CSV, and a C header of a few kilobytes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from reojax import so3
from reojax._internal import checks
from reojax._internal.files import check_ending, replacing
from reojax.steering.gains import CorrectionGains

_FIELDS = ("at", "theta", "theta_dot", "quaternion", "omega", "connection", "direction", "gramian", "rest")
_MEANING = {
    "at": "time [s] or path parameter",
    "theta": "joint angles [rad]",
    "theta_dot": "their rates",
    "quaternion": "orientation of the base, w x y z",
    "omega": "angular velocity of the base, base frame",
    "connection": "turn of the base per turn of each joint, base frame, row by row",
    "direction": "change of each joint per steering vector, row by row: p = -direction c",
    "gramian": "what the rest of the motion can turn, row by row",
    "rest": "added to its diagonal",
    "momentum": "angular momentum that the gains are made for, inertial frame [kg m^2/s]",
    "to_end": "what an error here is at the end if nothing is done, row by row",
}


def gain_table(gains: CorrectionGains) -> dict[str, np.ndarray]:
    """What the on-board law (`reojax.steering.onboard`) reads, by name; quaternions do not change sign on the way."""
    if not isinstance(gains, CorrectionGains):
        raise ValueError(f"`gains` is a {type(gains).__name__}; it must be what `correction_gains` returns.")
    quaternion = np.array([so3.to_quaternion(rotation) for rotation in gains.rotation], float)
    for k in range(1, len(quaternion)):
        quaternion[k] *= 1.0 if quaternion[k] @ quaternion[k - 1] >= 0 else -1.0
    table = {name: np.asarray(getattr(gains, name), float) for name in _FIELDS if name != "quaternion"}
    table["rest"] = np.full(len(quaternion), table["rest"])
    found = {name: quaternion if name == "quaternion" else table[name] for name in _FIELDS}
    momentum = np.asarray(gains.momentum, float)
    found["momentum"] = np.tile(momentum, (len(quaternion), 1))
    return found | ({"to_end": np.asarray(gains.to_end, float)} if momentum.any() else {})


def write_gains(gains: CorrectionGains, path: str | Path, *, name: str = "reojax_gains") -> None:
    """Write the table of the on-board law: `.csv`, all digits, or `.h`, C arrays of `float`.

    A row for each sample: time, joint angles and rates, orientation (w, x, y, z), angular velocity, connection (3 j),
    direction (3 j), Gramian (9) and rest, 21 + 8 j numbers. Four edges of three joints at 8 samples an edge are 5.5 kB
    of C floats, and hold joints and orientation to some 2e-3 rad; at 16 samples 11 kB and 1e-4 rad.
    `direction (gramian + rest)^-1 to_end` is the gain. The momentum that they are made for is in the file; where there
    is any, so is `to_end` (9 numbers a row), and without it errors stay what they are.

    Args:
        gains: the gains.
        path: file to write.
        name: prefix of the header's names.

    Raises:
        ValueError: for another kind of file or a name that C does not have, or if it cannot be written.
    """
    checks.instance("gains", gains, CorrectionGains, "`correction_gains` makes")
    ending = check_ending(path, "table of gains", ("csv", "h")).suffix.lower()
    table = gain_table(gains)
    if not (isinstance(name, str) and name.isascii() and name.isidentifier()):
        raise ValueError(f"`name` is {checks.shorten(name)}; it must be a name in C.")
    text = _csv(table) if ending == ".csv" else _header(table, name)
    with replacing(path) as file:
        file.write(text.encode())


def _csv(table: dict[str, np.ndarray]) -> str:
    names = []
    for field, values in table.items():
        ends = np.ndindex(values.shape[1:])
        names += ["_".join([field, *map(str, index)]) for index in ends]
    rows = np.concatenate([values.reshape(len(values), -1) for values in table.values()], axis=1)
    return "\n".join([",".join(names), *(",".join(repr(float(x)) for x in row) for row in rows)]) + "\n"


def _header(table: dict[str, np.ndarray], name: str) -> str:
    samples, joints = table["theta"].shape
    guard = f"{name.upper()}_H"
    lines = [
        "/* Correction gains of reojax. On board, with p the change of the joints and R the orientation here:",
        "   e = log(measured (R exp(connection p))^T), joints = theta + p, p = -direction c; the steering vector c",
        "   takes back what is left of the error: reojax/steering/onboard.py is the law. */",
        f"#ifndef {guard}",
        f"#define {guard}",
        f"#define {name.upper()}_SAMPLES {samples}",
        f"#define {name.upper()}_JOINTS {joints}",
        f"/* made for an angular momentum of {table['momentum'][0].tolist()} kg m^2/s, inertial frame */",
    ]
    for field, values in table.items():
        values = values[0] if field == "momentum" else values  # the same in each row
        sizes = "".join(f"[{size}]" for size in values.shape)
        lines.append(f"/* {_MEANING[field]} */")
        lines.append(f"static const float {name}_{field}{sizes} = {{")
        lines += [f"  {_c_literal(np.asarray(row))}," for row in values]
        lines.append("};")
    return "\n".join([*lines, f"#endif /* {guard} */", ""])


def _c_literal(values: np.ndarray) -> str:
    if values.ndim:
        return "{" + ", ".join(_c_literal(value) for value in values) + "}"
    text = f"{np.float32(values):.9g}"
    return f"{text}f" if any(c in text for c in ".en") else f"{text}.0f"
