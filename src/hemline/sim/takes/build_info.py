"""Versions and processor that a take was made with, for the record; its name does not depend on them."""

import functools
import platform
from importlib.metadata import version

import numpy as np

from hemline.version import VERSION


@functools.cache
def build_info() -> dict[str, str]:
    """Returns the versions of hemline, numba and NumPy, and the processor that kernels are compiled for, by name."""
    from llvmlite import binding  # the compiler that numba calls

    processor = f"{binding.get_host_cpu_name()} ({platform.machine()})"
    return {"hemline": VERSION, "numba": version("numba"), "numpy": np.__version__, "processor": processor}
