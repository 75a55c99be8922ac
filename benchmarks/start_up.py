"""How long does `import reojax` take, beside `import jax`?

    python benchmarks/start_up.py           # half a minute; --quick: fewer pairs

Fresh processes by turns; the first pair is not counted, so that bytecode is compiled and files are in the cache.
Writes start_up.json. Expected: reojax takes 0.1 to 0.2 s more than jax alone; matplotlib and SciPy wait until they
are used. Where Python may not write bytecode (PYTHONDONTWRITEBYTECODE) and has none, compiling it takes as long again.
"""

import os
import subprocess
import sys
from pathlib import Path
from statistics import median

from _command import machine, options, run

import reojax
from reojax.files import check_writable, write_json

MODULES = ("jax", "reojax")
LATER = ("matplotlib", "scipy", "optax", "tqdm.auto")
_TIMED = "import time; start = time.perf_counter(); import {}; print(time.perf_counter() - start)"


def main(out: Path, *, quick: bool) -> None:
    """Measure, print and write."""
    result = check_writable(out / "start_up.json")
    pairs = [[float(_said(_TIMED.format(module))) for module in MODULES] for _ in range(4 if quick else 16)][1:]
    jax, both = (list(times) for times in zip(*pairs, strict=True))
    more = [b - a for a, b in pairs]
    loaded = _said(f"import sys, reojax; print(*[name for name in {LATER} if name in sys.modules])").split()
    for name, times in (("import jax", jax), ("import reojax", both), ("difference", more)):
        print(f"{name:15} median {median(times):.3f} s, least {min(times):.3f}, most {max(times):.3f}")
    print(f"loaded already, of {', '.join(LATER)}: {', '.join(loaded) or 'none'}")
    write_json(result, {"machine": machine(), "jax": jax, "reojax": both, "difference": more, "loaded": loaded})


def _said(program: str) -> str:
    home = str(Path(reojax.__file__).parent.parent)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([home, os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True)
    return done.stdout


if __name__ == "__main__":
    run(main, options(__doc__))
