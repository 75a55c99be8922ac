"""A hostile test environment: strict shapes and dtypes, NaN is an error, float64 on."""

import jax

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_debug_nans", True)
