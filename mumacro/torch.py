"""Gone: says what to use instead."""

raise ModuleNotFoundError(
    "mumacro.torch is gone: use evaluate(gradient=True) inside torch.autograd.Function, as "
    "docs/how-to/embed.md shows",
    name="mumacro.torch",
)
