"""Run a manoeuvre over a grid of amplitudes and designs, of any size."""

import argparse
import json
import re
import sys
from math import prod
from typing import TYPE_CHECKING

from reojax._internal.display_units import display_unit
from reojax.cli._arguments import BadInput
from reojax.cli._axes import AXES, axis, check_names
from reojax.cli._limits import joints_beyond_limits, limits_text
from reojax.cli._manoeuvre import add_amplitudes
from reojax.cli._numbers import whole
from reojax.cli._results import add_files, check_files, complaint, table, write
from reojax.cli._robot import add_robot, layout_of, robot_of

if TYPE_CHECKING:
    import numpy as np

    from reojax.path import Path
    from reojax.robot import Robot

OUTPUTS = ("roll", "off_axis", "angle", "travel")
"""Results by name; all of them are angles."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the options of `reojax sweep`."""
    add = parser.add_argument
    units = ((name, display_unit(unit)[0]) for name, (unit, *_) in AXES.items())
    names = ", ".join(f"{name} [{unit}]" if unit else name for name, unit in units)
    add("axes", nargs="+", type=axis, metavar="AXIS", help=f"NAME=START:STOP:COUNT or NAME=VALUE,VALUE,...: {names}")
    add_robot(parser)
    add_amplitudes(parser, otherwise=", where it is no axis")
    add("--outputs", type=outputs, default=OUTPUTS, metavar="NAMES", help=f"results [{','.join(OUTPUTS)}]")
    add_files(parser)
    add("--store", metavar="FOLDER", help="keep finished chunks here, and go on from them when run again")
    add("--shard", type=shard, metavar="I/N", help="only every N-th chunk from the I-th on, I from 0 to N-1")
    add("--chunk-size", type=whole, metavar="DESIGNS", help="designs in a chunk [by the size of the sweep]")
    add("--devices", type=whole, metavar="K", help="use K devices of this host [all; every core is one]")
    add("--coordinator", metavar="HOST:PORT", help="run as one of several processes, which meet here")
    add("--processes", type=whole, metavar="N", help="how many they are")
    add("--process-id", type=int, metavar="K", help="which one this is, from 0 to N-1; 0 runs on HOST")
    add("--quiet", action="store_true", help="show no progress")


def run(args: argparse.Namespace) -> None:
    """Compute, write, and print; exit status 1 if designs gave no finite result."""
    import jax
    import numpy as np

    from reojax import session
    from reojax.cli._turns import turn_function
    from reojax.sweeps.sweep import run_sweep

    session.start()
    session.one_device_per_core()
    try:
        _check(args)
        if args.coordinator is not None:
            jax.distributed.initialize(args.coordinator, args.processes, args.process_id)
        axes = {axis.name: axis.values() for axis in args.axes}
        fixed = {"twist": np.deg2rad([args.twist]), "bend": np.deg2rad([args.bend])}
        amplitudes = {name: axes.get(name, value) for name, value in fixed.items()}
        robot = robot_of(args.robot)
        function = turn_function(robot, args.manoeuvre, args.outputs, amplitudes)
        units = {name: AXES[name].unit for name in axes if AXES[name].unit} | dict.fromkeys(args.outputs, "rad")
        options = (args.chunk_size, args.store, args.devices, not args.quiet, units, args.shard)
        found = run_sweep(function, axes, *options)
        if jax.process_index() == 0:
            if args.shard is not None or not (args.out or args.picture or args.store is None):
                report = {"store": args.store, "shard": args.shard, "bad": len(found.bad)}
                text = f"chunks in {args.store}; `reojax merge {args.store}` puts them together"
            else:
                report = write(found, args, f"Manoeuvre {args.manoeuvre.upper()} on {args.robot}")
                text = table(report)
            beyond = joints_beyond_limits(robot, _outermost(robot, args.manoeuvre, amplitudes))
            report["joints_beyond_limits"] = beyond
            text = "\n".join([text, *limits_text(args.robot, beyond)])
            print(json.dumps(report, indent=2, allow_nan=False) if args.json else text)
    except ValueError as error:
        raise BadInput(f"reojax sweep: {error}") from error
    if found.bad:
        print(complaint(found), file=sys.stderr)
        raise SystemExit(1)


def _outermost(robot: "Robot", manoeuvre: str, amplitudes: dict[str, "np.ndarray"]) -> list["Path"]:
    """The manoeuvre at the least and at the largest amplitudes: no design goes farther, either way."""
    from reojax.manoeuvres import BY_NAME

    twist, bend = amplitudes["twist"], amplitudes["bend"]
    ends = ((twist.min(), bend.min()), (twist.max(), bend.max()))
    return [BY_NAME[manoeuvre](*angles, layout_of(robot)) for angles in ends]


def outputs(text: str) -> tuple[str, ...]:
    """Read names of results, with commas between them (an argparse type)."""
    names = tuple(text.split(","))
    for name in names:
        if name not in OUTPUTS:
            raise argparse.ArgumentTypeError(f"there is no result {name!r}; the results are {', '.join(OUTPUTS)}")
        if names.count(name) > 1:
            raise argparse.ArgumentTypeError(f"result {name!r} is given twice")
    return names


def shard(text: str) -> tuple[int, int]:
    """Read `I/N`, I counted from 0 (an argparse type)."""
    first, _, parts = text.partition("/")
    if not (first.isdecimal() and parts.isdecimal() and int(first) < int(parts)):
        raise argparse.ArgumentTypeError(f"{text!r} is not I/N with I from 0 to N-1")
    return int(first), int(parts)


def _check(args: argparse.Namespace) -> None:
    """Refuse what cannot come to an end, before anything is computed."""
    check_names(args.axes)
    if args.shard is not None and (args.store is None or args.out or args.picture):
        raise ValueError("--shard needs --store, and not --out or --picture: `reojax merge` makes these of all shards.")
    together = (args.coordinator, args.processes, args.process_id)
    if any(option is not None for option in together):
        if None in together:
            raise ValueError("--coordinator, --processes and --process-id go together.")
        if not 0 <= args.process_id < args.processes:
            raise ValueError(f"--process-id is {args.process_id}; it must be from 0 to {args.processes - 1}.")
        if not re.fullmatch(r".+:[0-9]{1,5}", args.coordinator):
            raise ValueError(f"--coordinator is {args.coordinator!r}; it must be HOST:PORT.")
        if args.store is None:
            raise ValueError("--coordinator needs --store, a folder that all processes see.")
    if args.picture is not None and max(axis.size for axis in args.axes) < 2:
        raise ValueError("--picture needs an axis of two values or more.")
    check_files(args)
    if args.store is not None and (args.out or args.picture):
        from reojax.sweeps.memory import check_memory

        check_memory(prod(axis.size for axis in args.axes), 8 * len(args.outputs), "leave out --out and --picture")
