"""Self-collision: how far the shapes (capsules) of a robot stay clear of each other, at a posture and along a path.

`clearance` has the distances of all pairs at one posture, `path_clearance` a proven bound along a whole path.
"""
