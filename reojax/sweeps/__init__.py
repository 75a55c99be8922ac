"""Sweeps: a function over every design of a grid or list, at any size."""

from reojax.sweeps.grid import Zipped as Zipped, zipped as zipped
from reojax.sweeps.merge import merge as merge
from reojax.sweeps.result import BadDesign as BadDesign, Sweep as Sweep
from reojax.sweeps.sweep import sweep as sweep
