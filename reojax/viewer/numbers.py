"""The numbers beside a picture: what a motion comes to, as rows of text."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float

from reojax import so3
from reojax._internal.arrays import Array
from reojax.mechanics.attitude import tilt_and_roll
from reojax.viewer.clip import Clip

_MINUS = "\N{MINUS SIGN}"


def rows(clip: Clip, target: Float[np.ndarray, "3 3"] | None) -> dict[str, str]:
    """What there is to say of a motion, by name."""
    end = clip.rotation[0].T @ clip.rotation[-1]
    vector = np.rad2deg(np.asarray(so3.log(end), float))
    told = {
        "net rotation vector": f"({', '.join(_decimals(x, 2) for x in vector)})°",
        "net rotation angle": f"{_decimals(float(np.linalg.norm(vector)), 3)}°",
    }
    if clip.rotation[:, 2, 2].min() > -0.999:  # where z is never turned upside down, the roll can be counted on
        roll = tilt_and_roll(clip.rotation)[:, 2]
        told["roll about z, counted on"] = f"{_decimals(np.rad2deg(roll[-1] - roll[0]), 2)}°"
    if target is not None:
        told["left to the target"] = f"{np.rad2deg(angle_to(clip.rotation[-1:], target)[0]):.3g}°"
    told["joint travel, all joints"] = f"{np.rad2deg(clip.travel):.0f}°"
    if clip.timed:
        told["duration"] = f"{clip.clock[-1]:.4g} s"
    if clip.nearest is not None:
        told["least clearance"] = nearest(clip)
    told |= _of_motors(clip) | _of_certificate(clip)
    return told


def angle_to(rotation: Float[np.ndarray, "m 3 3"], target: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " m"]:
    """Angle of the turn from each rotation to the target [rad]; exact near 0 too, where an arc cosine is not."""
    turn = np.einsum("mji,jk->mik", rotation, target)
    sine = np.stack([turn[:, i, k] - turn[:, k, i] for i, k in ((2, 1), (0, 2), (1, 0))], axis=1)
    return np.arctan2(np.linalg.norm(sine, axis=1), np.trace(turn, axis1=1, axis2=2) - 1)


def nearest(clip: Clip) -> str:
    """Least clearance of a clip: distance, the two parts, and when; nothing where it was not looked for."""
    if clip.nearest is None:
        return ""
    place = clip.nearest.place
    gap = 1e3 * place.found
    how = f"{_decimals(-gap, 2)} mm deep in contact" if gap < 0 else f"{np.floor(1e5 * place.distance) / 100:.2f} mm"
    return f"{how}, {place.name}, at {clip.nearest.clock:.4g} {'s' if clip.timed else 'edges'}"


def _of_motors(clip: Clip) -> dict[str, str]:
    if clip.motion is None:
        return {}
    told = {
        "fastest joint": f"{np.abs(clip.motion.theta_dot).max():.3g} rad/s",
        "largest joint torque": f"{np.abs(clip.motion.torque).max():.3g} N m",
    }
    if clip.motion.margin is not None:
        told["least motor margin"] = f"{_decimals(100 * float(np.min(clip.motion.margin)), 0)} % of the supply"
    return told


def _of_certificate(clip: Clip) -> dict[str, str]:
    if clip.certificate is None:
        return {}
    certificate = clip.certificate
    return {
        "certificate: momentum left": f"{_small(certificate.momentum)} of what links exchange",
        "certificate: R\u1d40R \u2212 1": _small(certificate.orthogonality),
        "certificate: step halved": f"{_small(certificate.halving)} rad",
        "certificate: end of history": f"{_small(certificate.endpoint)} rad",
    }


def _small(value: Array) -> str:
    return f"{float(value):.0e}" if value > 1e-16 else "below 1e-16"


def _decimals(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}"
    return f"{0:.{digits}f}" if float(text) == 0 else text.replace("-", _MINUS)
