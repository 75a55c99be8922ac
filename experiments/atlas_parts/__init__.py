"""The parts of the atlas of turns."""
