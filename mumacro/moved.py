"""Import paths of former versions, and their replacements."""

MOVED = {
    "mumacro.inverse": "mumacro.solve_for(surrogate, unknown, target, **case)",
    "mumacro.law": "mumacro.law(surrogate, along, start=..., stop=..., **case)",
    "mumacro.settling": "mumacro.settling(surrogate, **case)",
    "mumacro.fitting": "mumacro.fit(data, unknowns)",
    "mumacro.element": "mumacro.Element(mu0, Fz, k)",
    "mumacro.fields": "mumacro.inputs.fields",
    "mumacro.interop": "mumacro.frames",
    "mumacro.analysis.load": "mumacro.analysis.stiffening",
    "mumacro.jax": "evaluate(gradient=True) inside jax.custom_vjp, as docs/how-to/embed.md shows",
    "mumacro.torch": "evaluate(gradient=True) inside torch.autograd.Function, as "
    "docs/how-to/embed.md shows",
}


class Signposts:
    """A finder of modules that loads none; for an import path of a former version its error names
    the replacement."""

    @staticmethod
    def find_spec(name: str, *_: object) -> None:
        """ModuleNotFoundError with the replacement of a former path; None for any other name."""
        if name in MOVED:
            raise ModuleNotFoundError(f"{name} is gone: use {MOVED[name]}", name=name)
        return
