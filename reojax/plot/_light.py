"""Light on the faces of robots, in 3-D axes and in flat ones alike."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from matplotlib.colors import to_rgb

from reojax.drawing.view import View


def shade(faces: Float[np.ndarray, "f 4 3"], colours: list[str], view: View) -> Float[np.ndarray, "f 3"]:
    """Colours (r, g, b) of faces in a light from above the viewer's left shoulder."""
    normal = np.cross(faces[:, 2] - faces[:, 0], faces[:, 3] - faces[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    light = np.array([-0.35, 0.65, 0.68]) @ view.camera()
    level = 0.62 + 0.38 * np.clip(normal @ light, -0.6, 1)
    palette = {colour: to_rgb(colour) for colour in set(colours)}
    return np.clip(np.array([palette[colour] for colour in colours]) * level[:, None], 0, 1)
