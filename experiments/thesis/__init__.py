"""Parts of `thesis_figures.py`."""
