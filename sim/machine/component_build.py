"""A component with a bench in C++, compiled once for each text and kept."""

from ..cache import cache_directory
from .library import BuildError, digest_of, kept_library, optimisation
from .verilog import component_verilog

__all__ = ["BuildError", "component_library"]


def component_library(component, *, bench, domains=(), defines=None, optimise=None, progress=lambda text: None):
    """Path of the shared library with a component as ``Vcomponent`` and its bench; compiles it if it is not there yet.

    Parameters
    ----------
    component : Component
        What to build, a member a.b as port a_b.
    bench : Path
        C++ text, which may include the headers of this folder.
    domains : tuple of str
        See :func:`~.verilog.component_verilog`.
    defines : dict from str to object
        Of the preprocessor.
    optimise : str, optional
        The compiler's option, if not the one for whole chips.
    progress : callable
        Is told what is being done.

    Raises
    ------
    BuildError
        If a tool fails or there is no compiler.
    """
    optimise = optimise or optimisation()
    text = component_verilog(component, name="component", domains=domains)
    key = digest_of(text, defines, optimise, bench=bench)
    return kept_library(cache_directory() / "components" / key, lambda: text, name="component", bench=bench,
                        defines=defines or {}, optimise=optimise, progress=progress)
