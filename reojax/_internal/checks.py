"""The one door of checks: what comes from outside is as it should be, or a `ValueError` names entry, value and rule.

Public functions call these once; what they call inside trusts its input.
"""

import difflib
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from numpy.typing import ArrayLike

from reojax._internal.arrays import as_numbers, is_concrete, refuse_lookalikes

T = TypeVar("T")

_LONGEST = 200
"""Characters of a value that a message shows."""
_MOST = 2**31 - 1
"""Largest integer that counts: more is a mistake, or memory that no machine has."""
ORTHOGONAL = 1e-6
"""Largest entry of `R^T R - 1` that rounding explains."""


def shorten(value: Any) -> str:
    """`repr` of a value, cut in the middle where it is long."""
    if isinstance(value, np.ndarray) and value.size > 64:
        return f"an array of shape {value.shape}"
    if isinstance(value, str | bytes) and len(value) > _LONGEST:
        value = value[:_LONGEST]
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST // 2]} ... {text[-_LONGEST // 4 :]}"


def instance(entry: str, value: Any, kind: type[T], example: str) -> T:
    """Return `value` if it is of the kind, such as `example`."""
    if not isinstance(value, kind):
        article = "an" if kind.__name__[0] in "AEIOU" else "a"
        raise ValueError(
            f"`{entry}` is a {type(value).__name__}; it must be {article} {kind.__name__}, such as {example}."
        )
    return value


def on_host(entry: str, value: Any, what: str) -> None:
    """Refuse traced numbers where `what` runs on the host."""
    if not is_concrete(value):
        raise ValueError(f"`{entry}` is traced; {what} runs on the host, outside of jit, vmap and grad.")


def whole(entry: str, value: Any, least: int = 1, most: int = _MOST) -> int:
    """Return one integer, from `least` to `most`."""
    if isinstance(value, bool | np.timedelta64) or not isinstance(value, int | np.integer) or value < least:
        rule = "a positive integer" if least == 1 else f"an integer of at least {least}"
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be {rule}.")
    if value > most:
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be at most {most}.")
    return int(value)


def number(entry: str, value: Any, *, unit: str = "", least: float = -np.inf, most: float = np.inf) -> float:
    """Return one finite real number from `least` to `most`."""
    array = np.asarray(as_numbers(entry, value))
    if array.shape or not np.isfinite(array) or not least <= array <= most:
        bounds = [f"at least {least:g}"] * (least > -np.inf) + [f"at most {most:g}"] * (most < np.inf)
        rule = " ".join(["one finite number", " and ".join(bounds)]).rstrip()
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be {rule}{f', in {unit}' if unit else ''}.")
    return float(array)


def positive(entry: str, value: Any, unit: str = "rad") -> float:
    """Return one positive finite number."""
    array = np.asarray(as_numbers(entry, value))
    if array.shape or not np.isfinite(array) or array <= 0:
        in_unit = f", in {unit}" if unit else ""
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be one positive number{in_unit}.")
    return float(array)


def seed(value: Any) -> int:
    """Return the `seed` of random numbers."""
    return whole("seed", value, 0)


def key(entry: str, value: Any) -> Any:
    """Return one key of `jax.random`, of either kind."""
    dtype = value.dtype if isinstance(value, jax.Array | np.ndarray) else None
    typed = dtype is not None and jnp.issubdtype(dtype, jax.dtypes.prng_key) and not value.shape
    raw = dtype == np.uint32 and value.shape == jax.eval_shape(lambda: jax.random.key_data(jax.random.key(0))).shape
    if not (typed or raw):
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be one key, as `jax.random.key(0)` makes.")
    return value


def function(entry: str, value: Any, *takes: str) -> Callable[..., Any]:
    """Return a function that can be called with so many arguments, as far as it tells."""
    if not callable(value):
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be a function of ({', '.join(takes)}).")
    try:
        inspect.signature(value).bind(*takes)
    except TypeError as error:
        raise ValueError(f"`{entry}` cannot be called with ({', '.join(takes)}): {error}.") from None
    except ValueError:  # it does not tell
        pass
    return value


def mapping(entry: str, value: Any, what: str) -> Mapping[Any, Any]:
    """Return a dictionary, or what can be read as one."""
    if not isinstance(value, Mapping):
        raise ValueError(f"`{entry}` is {shorten(value)}; it must map {what}.")
    return value


def rank(value: Any) -> int:
    """Number of axes of an array to be; -1 of what does not make one, which `numbers` refuses by name."""
    try:
        return np.ndim(value)
    except Exception:
        return -1


def listing(entry: str, value: Any, what: str) -> list[Any]:
    """Return the items of a list, or of anything else that can be gone through, but for a string."""
    if isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable):
        raise ValueError(f"`{entry}` is {shorten(value)}; it must list {what}.")
    return list(value)


def one_of(entry: str, value: Any, choices: Sequence[str]) -> str:
    """Return a name that is among `choices`."""
    if not isinstance(value, str) or value not in choices:
        known = ", ".join(map(repr, choices))
        raise ValueError(f"`{entry}` is {shorten(value)}; it must be one of {known}.{did_you_mean(value, choices)}")
    return value


def did_you_mean(value: Any, names: Iterable[str]) -> str:
    """A question that names what was probably meant, led by a space; nothing where nothing is near."""
    if not isinstance(value, str) or len(value) > _LONGEST:
        return ""
    lower = {name.lower(): name for name in names}
    near = difflib.get_close_matches(value.lower(), lower, 1, 0.6)
    return f" Did you mean {lower[near[0]]!r}?" if near else ""


def index_of(entry: str, value: Any, names: Sequence[str], kind: str) -> int:
    """Number of a link or joint (`kind`) that is given by number or by name."""
    if isinstance(value, str) and value in names:
        return list(names).index(value)
    if (
        isinstance(value, bool | np.timedelta64)
        or not isinstance(value, int | np.integer)
        or not 0 <= value < len(names)
    ):
        known = f"a number from 0 to {len(names) - 1} or one of {shorten(', '.join(names))[1:-1]}" if names else "none"
        raise ValueError(
            f"`{entry}` is {shorten(value)}; it must be a {kind} of the robot: {known}." + did_you_mean(value, names)
        )
    return int(value)


def indices_of(entry: str, value: Any, names: Sequence[str], kind: str) -> tuple[int, ...]:
    """Numbers of several links or joints, each once, in the order given."""
    items = (value,) if isinstance(value, str | int | np.integer) else value
    if not isinstance(items, Iterable):
        raise ValueError(f"`{entry}` is {shorten(value)}; it must list {kind}s of the robot by number or name.")
    found = [index_of(f"{entry}[{i}]", item, names, kind) for i, item in enumerate(items)]
    for i, item in enumerate(found):
        if item in found[:i]:
            raise ValueError(f"`{entry}` names {kind} {names[item]!r} twice.")
    return tuple(found)


def rotations(
    entry: str, value: ArrayLike, shape: tuple[int, ...] = (3, 3), tolerance: float = ORTHOGONAL
) -> np.ndarray:
    """Return rotations of shape (3, 3) or (m, 3, 3) in float64.

    Raises:
        ValueError: if they are not numbers, or not rotations; the text says by how much.
    """
    array = as_numbers(entry, value)
    on_host(entry, array, "what takes it")
    array = np.asarray(array, float)
    if array.ndim != len(shape) or array.shape[-2:] != (3, 3) or not array.size:
        text = str(shape).replace("-1", "m")
        raise ValueError(f"`{entry}` has shape {array.shape}; it must be {text}, at least one rotation.")
    for index, matrix in enumerate(array.reshape(-1, 3, 3)):
        name = f"`{entry}`" if array.ndim == 2 else f"{entry}[{index}]"
        if not np.isfinite(matrix).all():
            raise ValueError(f"{name} has an entry {matrix[~np.isfinite(matrix)][0]}; a rotation is finite.")
        away = np.abs(matrix.T @ matrix - np.eye(3)).max()
        if away > tolerance:
            raise ValueError(
                f"{name} is no rotation: an entry of R^T R - 1 is {away:.3g} in size; "
                f"rounding explains {tolerance:g} at most."
            )
        if np.linalg.det(matrix) < 0:
            raise ValueError(f"{name} is no rotation: its determinant is {np.linalg.det(matrix):.6g}, a reflection.")
    return array


def numbers(entry: str, value: Any, shape: tuple[int, ...], *, finite: bool = True) -> np.ndarray:
    """Return `value` as a float64 array of `shape` (-1: any length); no NaN, and no infinity if `finite`."""
    text = str(shape).replace("-1", "n")
    refuse_lookalikes(entry, value)
    try:
        given = np.asarray(value)
        if given.dtype.kind not in "iuf":  # digits in strings, truth values and complex numbers would convert
            raise TypeError(f"dtype {given.dtype}")
        array = given.astype(np.float64)
    except (TypeError, ValueError) as error:
        message = f"`{entry}` must be an array of real numbers of shape {text}; got {shorten(value)}."
        raise ValueError(message) from error
    if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape, strict=True)):
        raise ValueError(f"`{entry}` has shape {array.shape}; it must be {text}.")
    bad = ~np.isfinite(array) if finite else np.isnan(array)
    refuse(entry, array, bad, "it must be a finite number" if finite else "it must be a number")
    return array


def refuse(
    entry: str, array: np.ndarray, bad: np.ndarray, rule: str, unit: str = "", names: Sequence[str] = ()
) -> None:
    """Raise a `ValueError` for the first True of `bad`, with the entry's index (and name), value and rule."""
    if bad.any():
        index = tuple(int(i) for i in np.argwhere(bad)[0])
        where = ", ".join(map(str, index))
        called = f" ({names[index[0]]})" if names else ""
        raise ValueError(f"{entry}[{where}]{called} is {array[index].tolist()}{unit}; {rule}.")


def no_momentum(momentum: Any, what: str) -> None:
    """Refuse an angular momentum where turns are thought of as those of a path alone."""
    if momentum is not None and np.any(np.asarray(momentum) != 0):
        raise ValueError(
            f"`momentum` is {shorten(momentum)}; `{what}` is for zero angular momentum, where only the path counts. "
            "For a robot that already spins there is `reojax.righting`."
        )
