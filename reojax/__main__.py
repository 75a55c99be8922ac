"""Lets `python -m reojax` be the command line."""

import sys

from reojax.cli import main

if __name__ == "__main__":
    sys.exit(main())
