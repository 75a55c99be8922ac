"""Design by gradients: pose a problem over a robot and its loop, solve it, and say how certain the answer is."""

from reojax.design.solver import Solution as Solution, optimise as optimise
