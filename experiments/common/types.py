"""The array type of the experiments' signatures."""

import jax
import numpy as np

Array = jax.Array | np.ndarray
