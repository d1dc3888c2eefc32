"""Gone: says what to use instead."""

raise ModuleNotFoundError(
    "mumacro.jax is gone: use evaluate(gradient=True) inside jax.custom_vjp, as "
    "docs/how-to/embed.md shows",
    name="mumacro.jax",
)
