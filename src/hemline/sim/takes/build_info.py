"""What a take was made with, for the record: versions and processor, which its name does not depend on."""

import functools
import platform
from importlib.metadata import version

import numpy as np

from hemline.version import VERSION


@functools.cache
def build_info() -> dict[str, str]:
    """Versions of hemline, numba and NumPy, and the processor that kernels are compiled for, by name."""
    from llvmlite import binding  # the compiler that numba calls

    processor = f"{binding.get_host_cpu_name()} ({platform.machine()})"
    return {"hemline": VERSION, "numba": version("numba"), "numpy": np.__version__, "processor": processor}
