"""The compiled kernel, and the only Python that calls it."""
