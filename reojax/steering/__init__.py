"""Steering in flight: motions with angular momentum, and corrections of a motion while it runs (thesis 1.9)."""
