"""What `planning.py` measures, in a process of its own and of any version of reojax."""

import time

import jax
import numpy as np

import reojax

ROWS = {
    "plan_many, prototype, 270/120, at most 5": ("prototype", 2048, (270, 120), 5),
    "plan_many, prototype, 120/90, at most 6": ("prototype", 512, (120, 90), 6),
    "plan_many, six_body, 270/120, at most 5": ("six_body", 512, (270, 120), 5),
    "free_paths, prototype, 270/120": ("prototype", 32, (270, 120), 0),
    "free_paths, satellite_arm": ("satellite_arm", 8, None, 0),
}
"""Robot, targets, limits of twist and bend [deg], and at most so many manoeuvres; 0: free paths."""


def measure(names: list[str], share: float) -> dict[str, dict[str, float]]:
    """Targets a second, share reached and mean travel of those [deg], row by row."""
    jax.config.update("jax_enable_x64", True)
    found = {}
    for name in names:
        kind, count, degrees, most = ROWS[name]
        if not most and not hasattr(reojax, "free_paths"):  # the other version may be an old one
            continue
        robot = getattr(reojax.robots, kind)()
        four = np.random.default_rng(1).normal(size=(max(4, int(share * count)), 4))
        targets = np.asarray(jax.vmap(reojax.so3.from_quaternion)(four / np.linalg.norm(four, axis=1)[:, None]))
        limits = dict(zip(("twist_limit", "bend_limit"), np.deg2rad(degrees), strict=True)) if degrees else {}
        for _ in range(2):
            begin = time.perf_counter()
            if most:
                answer = reojax.plan_many(robot, targets, max_manoeuvres=most, **limits)
            else:
                answer = reojax.free_paths(robot, targets, **limits)
            seconds = time.perf_counter() - begin
        reached = np.asarray(answer.converged)
        travel = float(np.rad2deg(np.asarray(answer.travel)[reached].mean())) if reached.any() else float("nan")
        found[name] = {"rate": len(targets) / seconds, "reached": float(reached.mean()), "travel": travel}
    return found
