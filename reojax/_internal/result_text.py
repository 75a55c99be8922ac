"""How a result is printed: one line of figures and the verdict, where it is one result whose numbers can be read."""

from collections.abc import Callable
from typing import Any

import numpy as np

from reojax._internal.arrays import is_concrete


def printed_as(tell: Callable[[Any], str], single: str) -> Any:
    """A `__str__` that says what `tell` does; traced results, and many in one, are printed field by field.

    Args:
        tell: of one result to its line.
        single: a field that is one number, or whose first axis is time, of one result.
    """

    def text(result: Any) -> str:
        one = is_concrete(result) and np.ndim(getattr(result, single)) <= (single == "time")
        return tell(result) if one else repr(result)

    return text
