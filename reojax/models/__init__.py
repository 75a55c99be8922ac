"""Robots in and out of files: URDF, MJCF, and reojax's own JSON."""
