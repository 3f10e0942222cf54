"""The animator that is fitted to some datasets if none is named."""

from collections.abc import Sequence

from hemline.datasets import Dataset


def suited_animator(datasets: Sequence[Dataset]) -> str:
    """Returns the name of the animator that learns from what datasets hold.

    `agentdress` learns from drapes in poses on bodies of many shapes, `ropes` from takes of clips, and `lag` from takes
    of several garments. `hemline make` compares methods instead.

    Args:
        datasets: The datasets; `ropes` if there are none.
    """
    if len({dataset.garment.name for dataset in datasets}) > 1:
        return "lag"
    return "agentdress" if any(dataset.anchors() for dataset in datasets) else "ropes"
