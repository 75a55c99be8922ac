"""The parts of the design experiment."""
