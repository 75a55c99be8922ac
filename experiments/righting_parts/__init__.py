"""Parts of `righting.py`."""
