"""Momentum, its local connection, the holonomy of paths, dynamics: what a robot in free fall does."""
