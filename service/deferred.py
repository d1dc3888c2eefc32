"""What numba imports in order to compile is imported when something has to be compiled, which is on a first start only.

Before it takes a compiled function from its cache, numba loads what it knows about every type and function that it can
translate: two hundred modules, a quarter of the start and 9 MB, none of which takes part in running what was compiled.
"""

from typing import Any

from numba.core.compiler import CompilerBase
from numba.core.cpu import CPUContext
from numba.core.runtime.nrt import rtsys

__all__ = ["defer_registries"]


def defer_registries() -> None:
    """Load compiled functions without what it takes to compile.

    These are numba's own affairs: where they are not as expected, it does as it always did.
    """
    load: Any = getattr(CPUContext, "load_additional_registries", None)
    if load is None or hasattr(load, "deferred"):
        return
    begin: Any = CompilerBase.__init__
    needed = False

    def load_deferred(context: Any) -> None:
        if needed:
            load(context)
        else:
            rtsys.initialize(context)  # compiled functions call it

    def begin_with_all(*arguments: Any, **options: Any) -> None:
        nonlocal needed
        needed = True
        begin(*arguments, **options)  # which asks for everything, among other things

    load_deferred.deferred = True  # type: ignore[attr-defined]
    setattr(CPUContext, "load_additional_registries", load_deferred)  # noqa: B010 (an attribute of somebody else)
    setattr(CompilerBase, "__init__", begin_with_all)  # noqa: B010
