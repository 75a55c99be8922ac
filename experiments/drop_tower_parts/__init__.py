"""Parts of `drop_tower.py`."""
