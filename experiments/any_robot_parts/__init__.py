"""The parts of the experiment on public robot files."""
