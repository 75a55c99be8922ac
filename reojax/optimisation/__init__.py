"""Constrained optimisation from many starts; it knows nothing of robots."""
