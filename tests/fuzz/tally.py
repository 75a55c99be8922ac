"""What came of hostile inputs.

*Refused by name*: a `ValueError` (or, of an argument that is missing or not known, Python's own `TypeError`) raised by
reojax's own code, in at most `LONGEST` characters; of the command line status 2 and one line. *Fine*: every number that
comes back is finite, every rotation is one. *Wrong*: an answer with a number that is none, or a message without end.
*From inside*: any other exception, or one that is raised in somebody else's code. *Hung*: not back in `SLOWEST`
seconds.
"""

import signal
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jax
import numpy as np

import reojax

LONGEST = 2000
SLOWEST = 60
"""Longest time of one input, compiling included [s]."""
KINDS = ("refused by name", "fine", "wrong", "from inside", "hung")
_MAY_BE_NONE = {"Righting": ("margin", "least_duration", "clearance")}
"""What is documented to be NaN where it was not asked for."""
_OWN = (str(Path(reojax.__file__).parent), str(Path(__file__).parent))


class Hung(BaseException):
    """Not back in time."""


def _stop(*_: Any) -> None:
    raise Hung


class Tally(Counter[str]):
    """How many inputs were tried, and what came of them; `found` tells of what is neither fine nor refused."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def judge(self, what: str, call: Callable[[], Any]) -> None:
        """Try one input."""
        self["tried"] += 1
        kind, detail = self._verdict(call)
        self[kind] += 1
        if kind not in ("fine", "refused by name"):
            self.found.append(f"{kind}: {what}: {detail}")

    def _verdict(self, call: Callable[[], Any]) -> tuple[str, str]:
        before = signal.signal(signal.SIGALRM, _stop)
        signal.setitimer(signal.ITIMER_REAL, SLOWEST, 1)  # again, where somebody has swallowed it
        begin = time.monotonic()
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return self._sane(call())
        except Hung:
            return "hung", f"{time.monotonic() - begin:.0f} s"
        except ValueError as refusal:
            where = traceback.extract_tb(refusal.__traceback__)[-1]
            if not where.filename.startswith(_OWN):
                return "from inside", f"ValueError in {where.filename}: {str(refusal)[:150]}"
            long = len(str(refusal)) > LONGEST
            return ("wrong", f"a message of {len(str(refusal))} characters") if long else ("refused by name", "")
        except Exception as error:
            return "from inside", f"{type(error).__name__}: {str(error)[:150]}"
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
            signal.signal(signal.SIGALRM, before)

    @staticmethod
    def _sane(result: Any) -> tuple[str, str]:
        parts = result._asdict() if hasattr(result, "_asdict") else result
        if isinstance(parts, dict):
            parts = {
                name: part for name, part in parts.items() if name not in _MAY_BE_NONE.get(type(result).__name__, ())
            }
        leaves = [np.asarray(x) for x in jax.tree.leaves(parts) if isinstance(x, float | np.ndarray | jax.Array)]
        if isinstance(result, reojax.Comparison):  # NaN is what was not measured
            leaves = [np.asarray(result.offset), result.simulated_theta, result.simulated_rotation]
        if any(np.isnan(x).any() for x in leaves if x.dtype.kind == "f"):
            return "wrong", "a number that is none"
        turned = getattr(result, "rotation", None)
        if turned is not None and np.shape(turned)[-2:] == (3, 3):
            turned = np.asarray(turned, float)
            if not np.abs(np.swapaxes(turned, -1, -2) @ turned - np.eye(3)).max() < 1e-4:
                return "wrong", "a rotation that is none"
        return "fine", ""

    def __str__(self) -> str:
        return ", ".join(f"{self[kind]} {kind}" for kind in ("tried", *KINDS))
