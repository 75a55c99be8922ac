"""From where robots are looked at, in 3-D axes and in flat ones alike, and the light on them."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from matplotlib.colors import to_rgb


class View(NamedTuple):
    """Direction from which a picture is seen, from infinitely far away."""

    elevation: float = 20.0
    """Height of the eye above the plane across `up` [deg]."""
    azimuth: float = 62.0
    """Direction of the eye in that plane [deg]; for up = "y" from z towards x, for "z" from x towards y."""
    up: Literal["x", "y", "z"] = "y"
    """Axis that points up on the page."""

    def camera(self) -> Float[np.ndarray, "3 3"]:
        """Rows: what points right, up and towards the eye on the page."""
        e, a = np.deg2rad(self.elevation), np.deg2rad(self.azimuth)
        up = "xyz".index(self.up)
        eye = np.roll([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], up - 2)
        right = np.cross(np.eye(3)[up], eye)
        right = right / np.linalg.norm(right)
        return np.stack([right, np.cross(eye, right), eye])


def check_view(view: View) -> None:
    """Raise a ValueError for a view that is none."""
    if not isinstance(view, View) or view.up not in ("x", "y", "z"):
        raise ValueError(f"`view` is {view!r}; it must be a View whose `up` is x, y or z.")
    if not np.isfinite(view[:2]).all() or abs(view.elevation) >= 90:
        raise ValueError(f"`view` is {view}; angles must be finite, and the elevation between -90 and 90 degrees.")


def shade(faces: Float[np.ndarray, "f 4 3"], colours: list[str], view: View) -> Float[np.ndarray, "f 3"]:
    """Colours (r, g, b) of faces in a light from above the viewer's left shoulder."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    light = np.array([-0.35, 0.65, 0.68]) @ view.camera()
    level = 0.62 + 0.38 * np.clip(normal @ light, -0.6, 1)
    palette = {colour: to_rgb(colour) for colour in set(colours)}
    return np.clip(np.array([palette[colour] for colour in colours]) * level[:, None], 0, 1)
