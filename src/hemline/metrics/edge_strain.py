"""Summary of the strains of a garment's edges."""

import numpy as np

from hemline.arrays import Float


def edge_strain(strains: Float[np.ndarray, "*frames faces 3"]) -> dict[str, float]:
    """Returns median, 99th percentile and maximum of absolute strains.

    Args:
        strains: Strains from `meshes.edge_strains`, of one frame or of many.

    Returns:
        `p50`, `p99`, `max` [1].
    """
    p50, p99 = np.percentile(np.abs(strains), [50, 99])
    return {"p50": float(p50), "p99": float(p99), "max": float(np.abs(strains).max())}
