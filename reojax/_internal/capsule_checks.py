"""The door of `make_robot` for shapes: capsules as arrays, and which pairs of them must stay clear by default."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from reojax._internal.arrays import as_numbers
from reojax._internal.checks import listing, shorten


def check_capsules(capsules: Any, link_names: Sequence[str]) -> dict[str, Any]:
    """Return the fields `capsule_link`, `capsule_start`, `capsule_end` and `capsule_radius` of `Robot`.

    Raises:
        ValueError: naming the capsule, for an unknown link, an end that is no finite point, or a radius not positive.
    """
    links, starts, ends, radii = [], [], [], []
    for i, capsule in enumerate(listing("capsules", capsules, "capsules")):
        if not isinstance(capsule, tuple) or len(capsule) != 4:
            raise ValueError(f"capsules[{i}] is {shorten(capsule)}; it must be a Capsule(link, start, end, radius).")
        link, start, end, radius = capsule
        if isinstance(link, str) and link in link_names:
            link = link_names.index(link)
        if isinstance(link, bool) or not isinstance(link, int | np.integer) or not 0 <= link < len(link_names):
            raise ValueError(f"capsules[{i}].link is {shorten(link)}; the links are {', '.join(link_names)}.")
        for entry, point in (("start", start), ("end", end)):
            array = np.asarray(as_numbers(f"capsules[{i}].{entry}", point))
            if array.shape != (3,) or not np.isfinite(array).all():
                raise ValueError(f"capsules[{i}].{entry} is {shorten(point)}; it must be three finite numbers, in m.")
        number = np.asarray(as_numbers(f"capsules[{i}].radius", radius))
        if number.shape or not 0 < number < np.inf:
            raise ValueError(f"capsules[{i}].radius is {shorten(radius)}; it must be one positive number, in m.")
        links.append(int(link))
        starts.append(start)
        ends.append(end)
        radii.append(radius)
    return {
        "capsule_link": tuple(links),
        "capsule_start": np.array(starts, float).reshape(-1, 3),
        "capsule_end": np.array(ends, float).reshape(-1, 3),
        "capsule_radius": np.array(radii, float),
    }


def check_pairs(pairs: Any, capsule_link: tuple[int, ...]) -> tuple[tuple[int, int], ...]:
    """Return pairs of numbers of capsules on different links, lower number first.

    Raises:
        ValueError: naming the pair, if it is none.
    """
    found = []
    for i, pair in enumerate(listing("collision_pairs", pairs, "pairs of numbers of capsules")):
        numbers = tuple(pair) if isinstance(pair, tuple | list | np.ndarray) and np.ndim(pair) else ()
        if len(numbers) != 2 or not all(isinstance(n, int | np.integer) and not isinstance(n, bool) for n in numbers):
            raise ValueError(f"collision_pairs[{i}] is {shorten(pair)}; it must be two numbers of capsules.")
        first, second = sorted(map(int, numbers))
        if first < 0 or second >= len(capsule_link) or capsule_link[first] == capsule_link[second]:
            raise ValueError(
                f"collision_pairs[{i}] is ({first}, {second}); it must name two of the {len(capsule_link)} capsules, "
                "on different links."
            )
        found.append((first, second))
    return tuple(dict.fromkeys(found))


def default_pairs(fields: dict[str, Any]) -> tuple[tuple[tuple[int, int], ...], tuple[tuple[int, int], ...]]:
    """Pairs whose links are neither the same nor joined directly: those clear at `theta = 0`, and those that touch."""
    parent, link = fields["parent"], fields["capsule_link"]
    origin = [np.zeros(3)]
    for k, p in enumerate(parent):  # all frames are parallel at theta = 0
        origin.append(origin[p] + fields["anchor"][k])
    start = [origin[i] + s for i, s in zip(link, fields["capsule_start"], strict=True)]
    end = [origin[i] + e for i, e in zip(link, fields["capsule_end"], strict=True)]
    joined = {frozenset((k + 1, p)) for k, p in enumerate(parent)}
    clear, touching = [], []
    for a in range(len(link)):
        for b in range(a + 1, len(link)):
            if link[a] == link[b] or frozenset((link[a], link[b])) in joined:
                continue
            gap = segment_distance(start[a], end[a], start[b], end[b])
            gap -= fields["capsule_radius"][a] + fields["capsule_radius"][b]
            (clear if gap > 0 else touching).append((a, b))
    return tuple(clear), tuple(touching)


def segment_distance(start_a: np.ndarray, end_a: np.ndarray, start_b: np.ndarray, end_b: np.ndarray) -> float:
    """Distance between two line segments, exact for parallel and degenerate ones (Ericson 2005, 5.1.9)."""
    along_a, along_b, between = end_a - start_a, end_b - start_b, start_a - start_b
    aa, bb, ab = along_a @ along_a, along_b @ along_b, along_a @ along_b
    to_a, to_b = along_a @ between, along_b @ between
    candidates: list[tuple[Any, Any]] = [(s, np.clip((ab * s + to_b) / bb, 0, 1) if bb else 0.0) for s in (0.0, 1.0)]
    candidates += [(np.clip((ab * t - to_a) / aa, 0, 1) if aa else 0.0, t) for t in (0.0, 1.0)]
    determinant = aa * bb - ab * ab
    if determinant > 0:
        s, t = (ab * to_b - bb * to_a) / determinant, (aa * to_b - ab * to_a) / determinant
        if 0 <= s <= 1 and 0 <= t <= 1:
            candidates.append((s, t))
    return min(float(np.linalg.norm(between + s * along_a - t * along_b)) for s, t in candidates)
