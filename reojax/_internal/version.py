"""Which reojax this is, as saved files and the command line say it."""


def version() -> str:
    """Version of the installed package."""
    from importlib import metadata

    try:
        return metadata.version("reojax")
    except metadata.PackageNotFoundError:
        return "(not installed)"
