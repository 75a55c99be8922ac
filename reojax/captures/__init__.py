"""Captured motion beside simulation, and a robot's numbers from it."""
