"""What would the cameras see? Makes the synthetic capture that ships as an example, and tries to read it back.

    python experiments/synthetic_capture.py --out out          # some 10 s on 2 cores

Nothing is filmed: a robot whose end links and rotors differ from the prototype's does manoeuvre A at 270/120 in 0.6 s,
and is seen at 300 Hz through noise, with frames dropped. Writes `synthetic_capture.csv`, the same bytes every time;
`docs/synthetic_capture.csv` is that file.

Expected: the simulated orientation, from the measured joints, within 0.02 rad of the measured one after calibration,
and the two numbers in which the robot differs found within three of their own standard deviations.
"""

import io
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from common.script import options, run
from scipy.spatial.transform import Rotation, Slerp

import reojax
from reojax import robots
from reojax.files import check_writable, replacing, write_json

SEED = 7
RATE = 300.0  # Hz, thesis 1.8
DURATIONS = (0.1, 0.2, 0.1, 0.2)  # s, of the four edges; all fits in the fall of 0.639 s less 0.02 s
START = 0.18  # s, on the capture's clock
LATENCY = 0.0023  # s, by which the cameras' clock is ahead of the joints'
LENGTH = 1.0  # s
END_INERTIA, ROTOR_INERTIA = 62e-6, 0.11e-6  # kg m^2; the prototype has 70e-6 and 0.1e-6
JOINT_NOISE, TURN_NOISE = np.deg2rad(0.1), np.deg2rad(0.4)  # rad, per joint and per axis
DROPPED, LOST = 0.05, range(130, 142)  # share of frames that are not there; frames without orientation


class Truth(NamedTuple):
    """The motion behind the capture."""

    time: np.ndarray
    theta: np.ndarray
    rotation: np.ndarray


def true_robot() -> reojax.Robot:
    """The robot in the capture."""
    return robots.with_rotor_inertia(robots.with_end_inertia(robots.prototype(), END_INERTIA), ROTOR_INERTIA)


def truth(latency: float = LATENCY) -> Truth:
    """What the robot really does, at the times of all frames; the cameras see it `latency` late."""
    path = reojax.manoeuvre_a(np.deg2rad(270), np.deg2rad(120))
    history = np.asarray(reojax.rotation_history(true_robot(), path, samples=64))
    turned = Slerp(np.linspace(0, path.edges, len(history)), Rotation.from_matrix(history))
    time = np.arange(int(LENGTH * RATE)) / RATE
    corners = np.asarray(path.waypoints)
    theta = np.stack([np.interp(_along(time), range(path.edges + 1), corner) for corner in corners.T], axis=1)
    return Truth(time, theta, turned(_along(time - latency)).as_matrix())


def _along(time: np.ndarray) -> np.ndarray:
    """Edge and part of it at each time, by quintics at rest at both ends of each edge."""
    begin = START + np.concatenate([[0], np.cumsum(DURATIONS)[:-1]])
    x = np.clip((time[:, None] - begin) / DURATIONS, 0, 1)
    return (x**3 * (10 - 15 * x + 6 * x**2)).sum(axis=1)


def observed(seed: int) -> tuple[Truth, np.ndarray]:
    """The motion through noise and gaps: NaN where nothing was seen; and which frames are there at all."""
    rng = np.random.default_rng(seed)
    real = truth()
    frames = len(real.time)
    theta = real.theta + JOINT_NOISE * rng.normal(size=real.theta.shape)
    cameras = Rotation.random(rng=rng).as_matrix()
    shaken = Rotation.from_rotvec(TURN_NOISE * rng.normal(size=(frames, 3))).as_matrix()
    rotation = cameras @ real.rotation @ shaken
    theta[rng.random(theta.shape) < 0.01] = np.nan
    rotation[list(LOST)] = np.nan
    return Truth(real.time, theta, rotation), rng.random(frames) >= DROPPED


def as_csv(seed: int = SEED) -> str:
    """The capture as the text of a file."""
    seen, there = observed(seed)
    text = io.StringIO()
    text.write(
        f"# SYNTHETIC: no robot was filmed. Made by experiments/synthetic_capture.py, seed {seed}.\n"
        "# Manoeuvre A at 270/120 degrees, joints at theta1 to theta3, cameras on link 1 at 300 Hz, frames dropped.\n"
        f"# True robot: the prototype with end inertia {END_INERTIA * 1e6:g} and rotor inertia {ROTOR_INERTIA * 1e6:g} "
        f"kg mm^2; motion starts at {START} s;\n"
        f"# noise {np.rad2deg(JOINT_NOISE):g} deg a joint and {np.rad2deg(TURN_NOISE):g} deg an axis; "
        f"the cameras' clock is {LATENCY * 1e3:g} ms ahead.\n"
        "time_s,theta1_deg,theta2_deg,theta3_deg,qw,qx,qy,qz\n"
    )
    for k in np.flatnonzero(there):
        quaternion = np.full(4, np.nan)
        if np.isfinite(seen.rotation[k]).all():
            quaternion = Rotation.from_matrix(seen.rotation[k]).as_quat(scalar_first=True)
        cells = [f"{seen.time[k]:.5f}", *(f"{x:.2f}" for x in np.rad2deg(seen.theta[k]))]
        cells += [f"{x:.5f}" for x in quaternion]
        text.write(",".join("" if cell == "nan" else cell for cell in cells) + "\n")
    return text.getvalue()


def main(out: Path, *, quick: bool = False) -> dict[str, Any]:
    """Write the capture and what is found in it to `out`, and return the numbers."""
    file, table = check_writable(out / "synthetic_capture.csv"), check_writable(out / "synthetic_capture.json")
    with replacing(file) as stream:
        stream.write(as_csv().encode())
    robot = robots.prototype()
    capture = reojax.read_capture(file, robot)
    before = reojax.compare(robot, capture)
    fit = reojax.calibrate(robot, capture, ("end_inertia", "rotor_inertia"))
    true = np.array([END_INERTIA, ROTOR_INERTIA])
    off = np.abs(fit.values - true) / fit.std
    print(f"{len(capture.time)} frames, {capture.seen_rotation.sum()} with orientation")
    print(f"{'':24}{'true':>12}{'start':>12}{'found':>12}{'+-':>10}")
    for name, *row in zip(fit.names, true, fit.start, fit.values, fit.std, strict=True):
        print(f"{name + ' [kg mm^2]':24}" + "".join(f"{x * 1e6:12.5f}" for x in row[:3]) + f"{row[3] * 1e6:10.5f}")
    shift = f"{LATENCY * 1e3:12.3f}{0:12.3f}{fit.offset * 1e3:12.3f}{fit.offset_std * 1e3:10.3f}"
    print(f"{'clocks apart [ms]':24}{shift}")
    print(f"angle to the measured orientation: {before.angle_rms:.4f} rad RMS before, {fit.rms:.4f} after")
    result = {
        "seed": SEED,
        "frames": len(capture.time),
        "true": true,
        "start": fit.start,
        "found": fit.values,
        "std": fit.std,
        "offset_s": fit.offset,
        "offset_std_s": fit.offset_std,
        "rms_before_rad": before.angle_rms,
        "rms_rad": fit.rms,
        "converged": bool(fit.converged and (off < 3).all() and fit.rms < 0.02),
    }
    write_json(table, result)
    return result


if __name__ == "__main__":
    run(main, options(__doc__))
