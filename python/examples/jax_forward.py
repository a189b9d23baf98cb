# %% [markdown]
# # The identified arm within JAX
#
# Positions by `pure_callback`, derivatives by the arm's own Jacobian: `grad`, `jacfwd` and `vmap` see an ordinary function.

# %%
# mypy: disable-error-code=untyped-decorator
import warnings
from collections.abc import Callable
from pathlib import Path

import flexcal
import jax
import jax.numpy as jnp
import numpy as np

jax.config.update("jax_enable_x64", True)
ROOT = Path(__file__).parents[2] if "__file__" in globals() else Path.cwd()
warnings.simplefilter("ignore", flexcal.FlexcalWarning)
arm = flexcal.Problem(ROOT / "problems" / "lunar-sampler").identify()


# %%
@jax.custom_jvp
def position(q: jax.Array) -> jax.Array:
    """End point [m] of configurations, shape (..., joints) [rad]."""
    shape = jax.ShapeDtypeStruct((*q.shape[:-1], 3), q.dtype)
    return jax.pure_callback(lambda q: _rows(arm.predict, q, (3,)), shape, q, vmap_method="expand_dims")


@position.defjvp
def _(primals: tuple[jax.Array], tangents: tuple[jax.Array]) -> tuple[jax.Array, jax.Array]:
    (q,), (direction,) = primals, tangents
    shape = jax.ShapeDtypeStruct((*q.shape[:-1], 3, q.shape[-1]), q.dtype)
    jacobian = jax.pure_callback(lambda q: _rows(arm.jacobian, q, shape.shape[-2:]), shape, q, vmap_method="expand_dims")
    return position(q), jnp.einsum("...ij,...j->...i", jacobian, direction)


def _rows(function: Callable[[np.ndarray], np.ndarray], q: np.ndarray, of_each: tuple[int, ...]) -> np.ndarray:
    """A function of rows on an array whose last dimension is a row."""
    q = np.asarray(q)
    return function(q.reshape(-1, q.shape[-1])).reshape(*q.shape[:-1], *of_each)


# %% [markdown]
# The configuration nearest to a start that reaches a point: Newton's method on JAX's derivatives.

# %%
q = jnp.array([0.3, 0.5, -0.8, 0.4])
target = position(q) + jnp.array([0.05, -0.02, 0.03])
for _ in range(6):
    miss = target - position(q)
    q = q + jnp.linalg.pinv(jax.jacfwd(position)(q)) @ miss
print("miss:", float(jnp.linalg.norm(target - position(q))), "m at", np.rad2deg(q), "°")
assert jnp.linalg.norm(target - position(q)) < 1e-9

height = jax.grad(lambda q: position(q)[2])
step = 1e-6
difference = (position(q.at[1].add(step)) - position(q.at[1].add(-step)))[2] / (2 * step)
assert abs(height(q)[1] - difference) < 1e-6
assert jax.vmap(position)(jnp.stack([q, q])).shape == (2, 3)
