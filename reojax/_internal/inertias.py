"""Inertias that no rigid body has, and the nearest ones that one has."""

import itertools
from collections.abc import Sequence

import numpy as np

TOLERANCE = 1e-6
"""Share by which the triangle rule may be missed: rounding of float32 and of a file's digits."""
NOISE = 1e-15
"""Moments below this share of the robot's largest are rounding."""

_RULES = np.array([[-1.0, 1, 1], [1, -1, 1], [1, 1, -1]])
"""Rows whose products with the principal moments must not be negative; so are the moments then."""


def breaks_triangle(moments: np.ndarray, noise: float) -> bool:
    """Whether one of the principal moments is negative or larger than the sum of the other two, by more than rounding.

    Args:
        moments: (3,) [kg m^2].
        noise: moments below this are rounding [kg m^2].
    """
    return bool((_RULES @ moments).min() < -TOLERANCE * np.abs(moments).max() - noise)


def nearest_possible(inertia: np.ndarray) -> np.ndarray:
    """The possible inertia with the least change in the Frobenius norm (change of all entries, squared and summed).

    The set of possible inertias is convex and does not depend on the frame, so the nearest one has the same principal
    axes, and moments projected on the three triangle rules.
    """
    moments, frame = np.linalg.eigh(0.5 * (inertia + inertia.T))
    best, least = np.zeros(3), np.inf
    for active in itertools.chain.from_iterable(itertools.combinations(range(3), k) for k in range(4)):
        rules = _RULES[list(active)]
        projected = moments - (np.linalg.pinv(rules) @ rules @ moments if active else 0.0)
        change = np.linalg.norm(projected - moments)
        if (_RULES @ projected).min() >= -1e-12 * np.abs(moments).max() and change < least:
            best, least = projected, change
    return frame @ np.diag(best) @ frame.T


def mend(inertia: np.ndarray, names: Sequence[str], *, repair: bool, notes: list[str]) -> np.ndarray:
    """Return possible inertias (n, 3, 3); the others are repaired and noted, or refused.

    Raises:
        ValueError: naming each link and its principal moments, unless `repair`.
    """
    mended, told = inertia.copy(), []
    noise = NOISE * np.abs(inertia).max()
    for i, name in enumerate(names):
        if breaks_triangle(np.linalg.eigvalsh(0.5 * (inertia[i] + inertia[i].T)), noise):
            mended[i] = nearest_possible(inertia[i])
            before, after = (np.linalg.eigvalsh(0.5 * (x + x.T)) for x in (inertia[i], mended[i]))
            told.append((name, before, after))
    if told and not repair:
        listed = "; ".join(f"{name!r:.60}: {_moments(before)}" for name, before, _ in told[:6])
        more = f"; and {len(told) - 6} more" if len(told) > 6 else ""
        raise ValueError(
            f"no rigid body has the principal moments [kg m^2] of {listed}{more}: none may be negative, nor larger "
            "than the sum of the other two; repair=True takes the nearest possible ones"
        )
    notes += [
        f"repaired: inertia of link {name!r:.60}, principal moments {_moments(before)} to {_moments(after)} kg m^2"
        for name, before, after in told
    ]
    return mended


def _moments(moments: np.ndarray) -> str:
    return ", ".join(f"{value:.6g}" for value in moments)
