"""Colours that colour-blind people can tell apart and that print (after Okabe and Ito)."""

INK, GREY, PALE = "#222222", "#888888", "#d9d9d9"
JOINTS = ("#0072b2", "#e69f00", "#56b4e9", "#7f3c8d", "#80ba5a", "#666666")
"""Colours of joints, in order."""
DASHES = ((None, None), (None, None), (5, 2.5), (1.5, 1.5))
"""By joint; two joints may move alike, and the one drawn last must not hide the other."""
BASE = "#d55e00"
LINKS = ("#a9c8de", "#dfe3e6", "#3f7fb5", "#f0c75e")
"""Colours of links after the base, in order."""
AXES = ("#009e73", "#cc79a7", "#d55e00")
"""Colours of x, y and z, and so of tilt about x, tilt about y and roll about z."""
ANGLES = tuple(zip(("tilt about x", "tilt about y", "roll about z"), AXES, strict=True))
"""The base's angles, as `tilt_and_roll` gives them, and their colours."""


def link_colour(link: int) -> str:
    """Colour of a link by its number; the base is red."""
    return BASE if not link else LINKS[(link - 1) % len(LINKS)]
