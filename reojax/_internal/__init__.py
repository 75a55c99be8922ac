"""Small things that the packages share: array types, the door of checks, linear algebra, files, units of display."""
