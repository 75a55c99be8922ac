"""What `progress=` means in every function that has it: whether to show a bar on stderr, or what to write before it."""


def label(progress: bool | str) -> str | None:
    """Return what to write before the bar, if anything was given."""
    return progress if isinstance(progress, str) else None
