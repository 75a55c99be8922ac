"""Sweeps: a function over every design of a grid or list, at any size."""

from reojax.sweep.grid import Zipped as Zipped, zipped as zipped
from reojax.sweep.merge import merge as merge
from reojax.sweep.run import sweep as sweep
from reojax.sweep.table import BadDesign as BadDesign, Sweep as Sweep
