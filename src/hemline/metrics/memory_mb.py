"""The memory that a run needed."""

import sys


def memory_mb() -> float | None:
    """Largest resident size of this process so far [MB, 10^6 bytes]; None where the system does not say (Windows)."""
    try:
        import resource
    except ImportError:
        return None
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak * 1024 / 1e6
