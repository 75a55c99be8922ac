"""Parts of `steering.py`."""
