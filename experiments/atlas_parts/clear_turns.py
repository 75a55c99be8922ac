"""Turns of little travel that keep a clearance, of robots with many pairs of shapes: by a working set of pairs.

A search that looks at all pairs of a legged robot at every step takes minutes. Most pairs hardly ever come near each
other. So a search looks only at pairs which came too near on what was found without them, then also at those which do
on what it finds itself, and so on; what is handed on is proven with all pairs.
"""

from typing import NamedTuple

import jax
import numpy as np

import reojax
from atlas_parts.subjects import Subject, box_of
from reojax.robots import with_capsules

_ROUNDS = 4
"""How often pairs are added."""
_USED = 0.97
"""Share of the farthest loop that a run is asked for."""
_ANY = 2.95
"""A loop that turns this far [rad], nearly the most that is looked for, is taken to do for any turn about its axis."""
_TRIES = 2
"""Numbers of runs tried, each a quarter more than the one before, or one."""
_EVEN, _RANDOM = (1.0, 0.6, 0.4), 2
"""Shares of the box of joint limits, and number of random boxes."""
_HELD = ((9, (1.0, 0.4)), (10**9, (0.4, 0.2, 0.1)))
"""Shares of that box within which all pairs are held apart, of robots of up to so many joints."""
_CORNERS = ((4, 8), (8, 6), (10**9, 5))
"""Free corners of robots of up to so many joints."""
_SAMPLES = 48
"""Postures per edge at which pairs are looked at for being too near."""


class Effort(NamedTuple):
    """How hard to search."""

    starts: int
    steps: int


class Turns(NamedTuple):
    """One path for each of m targets."""

    waypoints: np.ndarray
    """(m, v, j) corners of one run [rad]."""
    runs: np.ndarray
    """(m,) how often each is run."""
    travel: np.ndarray
    """(m,) joint travel of all runs [rad]."""
    reached: np.ndarray
    """(m,) whether it ends on its target, with the clearance if one was asked for."""
    status: np.ndarray
    """(m,) in words."""
    most: np.ndarray
    """(m,) how far one loop was found to turn about the target's axis [rad]."""
    farthest: np.ndarray
    """(m, v, j) that loop."""


class _Search(NamedTuple):
    """How one search is made."""

    robot: reojax.Robot
    """With those of its pairs that are looked at."""
    margin: float | None
    """What these keep apart [m]."""
    effort: Effort
    low: np.ndarray
    """(j,) [rad]"""
    high: np.ndarray
    """(j,) [rad]"""
    tries: int = _TRIES


def free_turns(subject: Subject, targets: np.ndarray, effort: Effort) -> Turns:
    """Turns without a clearance."""
    found = _nothing(subject, targets)
    _improve(found, None, subject, targets, _Search(subject.robot, None, effort, *box_of(subject)), proof=None)
    return found


def clear_turns(subject: Subject, targets: np.ndarray, effort: Effort, touching: Turns) -> Turns:
    """Turns that keep the subject's clearance, proven with all pairs; from those that were found without."""
    robot, found, pairs = subject.robot, _nothing(subject, targets), set()
    tried = [*touching.waypoints[touching.reached], *touching.farthest]
    for _ in range(_ROUNDS):
        new = _too_near(robot, tried, subject.clearance) - pairs
        if pairs and not new:
            break
        pairs |= new
        few = with_capsules(robot, robot.capsules, sorted(pairs)) if pairs else robot
        margin = subject.clearance if pairs else None
        search = _Search(few, margin, effort, *box_of(subject))
        tried = _improve(found, None, subject, targets, search, proof=subject.clearance)
        if found.reached.all():
            break
    return found


def boxed_turns(
    subject: Subject, targets: np.ndarray, effort: Effort, *, most: int | None = None
) -> tuple[Turns, Turns]:
    """Turns that keep the subject's clearance, for robots of many joints and pairs: within boxes where little touches.

    The search looks at no pair at all; it is made within smaller and smaller boxes about the posture at rest, and
    within random ones, and of its answers those count which are proven clear with all pairs. The second answer are the
    turns of the largest box, clear or not. `most` boxes, by default all.
    """
    best, largest = _nothing(subject, targets), _nothing(subject, targets)
    for k, (low, high) in enumerate(_boxes(subject)[:most]):
        found, touching = _nothing(subject, targets), _nothing(subject, targets)
        search = _Search(subject.robot, None, effort, low, high, tries=1)
        _improve(found, touching, subject, targets, search, proof=subject.clearance)
        largest = largest if k else touching
        for i in range(len(targets)):
            if found.reached[i] and not (best.reached[i] and best.travel[i] <= found.travel[i]):
                for field in ("waypoints", "runs", "travel", "reached"):
                    getattr(best, field)[i] = getattr(found, field)[i]
            if not best.reached[i] or found.reached[i]:
                best.status[i] = found.status[i]
            if found.most[i] > best.most[i]:
                best.most[i], best.farthest[i] = found.most[i], found.farthest[i]
    return best, largest


def held_turns(subject: Subject, targets: np.ndarray, effort: Effort) -> Turns:
    """Turns that keep the subject's clearance, by a search that holds all pairs of shapes apart at every step.

    Within smaller and smaller boxes about the posture at rest, as far as targets are left: of a robot with many joints
    hardly a random polygon of the whole box is clear, and out of deep contact the search finds no way.
    """
    found = _nothing(subject, targets)
    for share in next(shares for most, shares in _HELD if subject.robot.joints <= most):
        if found.reached.all():
            break
        low, high = _box(subject, np.full((2, subject.robot.joints), share))
        search = _Search(subject.robot, subject.clearance, effort, low, high)
        _improve(found, None, subject, targets, search, proof=subject.clearance)
    return found


def _boxes(subject: Subject) -> list[tuple[np.ndarray, np.ndarray]]:
    """Boxes of joint angles about the posture at rest: even ones, then random ones."""
    joints, rng = subject.robot.joints, np.random.default_rng(0)
    shares = [np.full((2, joints), share) for share in _EVEN]
    shares += [rng.uniform(0.1, 1.0, (2, joints)) for _ in range(_RANDOM)]
    return [_box(subject, share) for share in shares]


def _box(subject: Subject, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Smallest and largest angles (j,) of shares (2, j) of what the joints can go from rest, down and up."""
    low, high = box_of(subject)
    return subject.start + share[0] * (low - subject.start), subject.start + share[1] * (high - subject.start)


def _too_near(robot: reojax.Robot, paths: list[np.ndarray], margin: float) -> set[tuple[int, int]]:
    """Pairs that come nearer than the margin on some of the paths (v, j), by samples."""
    if not robot.collision_pairs or not len(paths):
        return set()
    place = np.linspace(0, 1, _SAMPLES)[:, None]
    near = np.full(len(robot.collision_pairs), False)
    look = jax.jit(jax.vmap(lambda theta: reojax.clearance(robot, theta)))
    for path in paths:
        postures = (path[:-1, None] + place * np.diff(path, axis=0)[:, None]).reshape(-1, robot.joints)
        near |= np.asarray(look(postures)).min(0) < margin
    return {robot.collision_pairs[k] for k in np.flatnonzero(near)}


def _axes(targets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Axes (m, 3) and angles (m,) of targets."""
    vectors = np.array([np.asarray(reojax.so3.log(target)) for target in targets])
    angles = np.linalg.norm(vectors, axis=1)
    return vectors / angles[:, None], angles


def _nothing(subject: Subject, targets: np.ndarray) -> Turns:
    """Turns of which none is found yet."""
    count = len(targets)
    stay = np.tile(subject.start, (count, _corners(subject) + 2, 1))
    return Turns(
        stay, np.ones(count, int), np.full(count, np.inf), np.full(count, False),
        np.array(["not found"] * count, object), np.zeros(count), stay.copy(),
    )  # fmt: skip


def _corners(subject: Subject) -> int:
    return next(number for most, number in _CORNERS if subject.robot.joints <= most)


def _is_kept(subject: Subject, path: np.ndarray, margin: float | None) -> bool:
    """Whether a path (v, j) is proven to keep a clearance, all pairs looked at."""
    if margin is None or not subject.robot.collision_pairs:
        return True
    return float(reojax.path_clearance(subject.robot, reojax.Path(path)).distance) >= margin


def _improve(
    found: Turns, touching: Turns | None, subject: Subject, targets: np.ndarray, search: _Search, proof: float | None
) -> list[np.ndarray]:
    """Solve the targets that are not reached; changes `found`, and returns all paths (v, j) that were tried.

    What is reached but not proven to keep the clearance `proof` goes into `touching`.
    """
    going = np.flatnonzero(~found.reached)
    axes, angles = _axes(targets[going])
    able, tried = _farthest(found, subject, going, axes, search, proof)
    runs = np.where(able > _ANY, 1, np.ceil(angles / np.maximum(_USED * able, 1e-2))).astype(int)
    runs = np.where(able > 0, runs, 1)
    for _ in range(search.tries):
        unable = np.array([str(found.status[k]).startswith("unreachable") for k in going], bool)
        left = np.flatnonzero(~found.reached[going] & ~unable)
        for number in np.unique(runs[left]):
            mine = going[left[runs[left] == number]]
            tried += _solve(found, touching, subject, targets, mine, int(number), search, proof)
        runs = np.where(able > 0, np.maximum(runs + 1, 5 * runs // 4), 1)
    return tried


def _farthest(
    found: Turns, subject: Subject, going: np.ndarray, axes: np.ndarray, search: _Search, proof: float | None
) -> tuple[np.ndarray, list[np.ndarray]]:
    """How far one loop turns about some axes (m, 3), whether all pairs are clear or not (m,), and these loops."""
    able, tried = np.zeros(len(axes)), []
    for axis in np.unique(np.round(axes, 12), axis=0):
        mine = np.flatnonzero(np.abs(axes - axis).max(1) < 1e-9)
        loop = reojax.farthest_turn(
            search.robot, axis, start=subject.start, lower=search.low, upper=search.high, clearance=search.margin,
            corners=_corners(subject), starts=search.effort.starts, max_steps=search.effort.steps,
        )  # fmt: skip
        if not loop.converged:
            found.status[going[mine]] = loop.status
            continue
        tried.append(loop.waypoints)
        able[mine] = angle = float(reojax.so3.angle(loop.rotation))
        if _is_kept(subject, loop.waypoints, proof):
            for k in going[mine]:
                if angle > found.most[k]:
                    found.most[k], found.farthest[k] = angle, loop.waypoints
    return able, tried


def _solve(
    found: Turns,
    touching: Turns | None,
    subject: Subject,
    targets: np.ndarray,
    mine: np.ndarray,
    runs: int,
    search: _Search,
    proof: float | None,
) -> list[np.ndarray]:
    """Turns of so many runs; changes `found` and `touching`, and returns the paths."""
    answer = reojax.free_paths(
        search.robot, targets[mine], start=subject.start, repeats=runs, clearance=search.margin,
        corners=_corners(subject), starts=search.effort.starts, max_steps=search.effort.steps,
        lower=search.low, upper=search.high,
    )  # fmt: skip
    for i, k in enumerate(mine):
        found.status[k] = str(answer.status[i])
        kept = bool(answer.converged[i]) and _is_kept(subject, answer.waypoints[i], proof)
        for turns, done in ((found, kept), (touching, answer.converged[i])):
            if turns is not None and done:
                turns.waypoints[k], turns.runs[k], turns.travel[k] = answer.waypoints[i], runs, answer.travel[i]
                turns.reached[k] = True
    return list(answer.waypoints)
