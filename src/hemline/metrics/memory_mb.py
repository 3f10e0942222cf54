"""Peak memory of this process."""

import sys


def memory_mb() -> float | None:
    """Returns the peak resident size of this process [MB, 10^6 bytes]; None if the system does not tell (Windows)."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak * 1024 / 1e6
