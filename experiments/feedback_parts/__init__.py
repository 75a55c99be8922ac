"""Parts of `feedback.py`."""
