"""Motions in time: time laws, motors, simulation, least time, control, imperfect releases."""
