"""The decorator that compiles a function over plain arrays."""

import functools
from collections.abc import Callable
from typing import Any

import numba

from .cache import KernelCache
from .pack import aim_numba
from .threads import call_parallel, threads

aim_numba()


def kernel(function: Callable[..., Any] | None = None, **options: Any) -> Any:
    """Decorator that compiles a function with numba at its first call, and keeps the result on disk.

    Division by zero gives inf or NaN, as in NumPy. The function must not use objects: it takes arrays, scalars and
    named tuples of arrays, and writes to arrays. Its docstring says what it reads, writes and returns, with shapes and
    units.

    A parallel kernel names the arrays of a named tuple before its loop, as in `energy_out = out.energy`: numba removes
    stores to `out.energy[i]`, or to names unpacked from `out`, as dead code.

    Args:
        function: The function.
        options: Options of `numba.njit`, such as `fastmath=True` or `inline="always"`. With `parallel=True` a
            `ParallelKernel` is made, which other kernels cannot call.
    """
    if function is None:
        return functools.partial(kernel, **options)
    if options.get("parallel"):
        return ParallelKernel(function, options)
    return _compile(function, options)


class ParallelKernel:
    """A kernel with parallel loops, called from Python; with one thread its loops run sequentially.

    The sequential version needs no thread pool, so it never waits for one and can be called from several threads at
    once on any machine.
    """

    def __init__(self, function: Callable[..., Any], options: dict[str, Any]):
        functools.update_wrapper(self, function)
        self.py_func, self._options = function, options

    @functools.cached_property
    def _plain(self) -> Any:
        return _compile(self.py_func, self._options | {"parallel": False})

    @functools.cached_property
    def _parallel(self) -> Any:
        return _compile(self.py_func, self._options)

    def __call__(self, *arguments: Any) -> Any:
        return self._plain(*arguments) if threads() == 1 else call_parallel(self._parallel, arguments)


def _compile(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    whole = {"error_model": "numpy", "nogil": True} | options
    made: Any = numba.njit(**whole)(function)
    made._cache = KernelCache(function, whole)
    return made
