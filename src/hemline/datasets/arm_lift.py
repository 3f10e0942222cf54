"""The angle by which hanging arms were lifted in the poses that a garment was settled in."""

from hemline.bodies.lifted_arms import FORMER_LIFT_DEG, LIFT_DEG
from hemline.errors import BadDataset

from .dataset import Dataset
from .take import take_metadata


def arm_lifts_deg(dataset: Dataset) -> set[float]:
    """Returns the angles by which hanging arms were lifted in the poses of a dataset, 0 for poses as recorded [deg]."""
    inputs = [take_metadata(dataset.path(row.name))["inputs"] for row in dataset.rows() if row.kind == "anchor"]
    return {float(each.get("lift_deg", FORMER_LIFT_DEG)) for each in inputs if "protocol" in each}


def arm_lift_deg(dataset: Dataset) -> float:
    """Returns the angle by which a model lifts hanging arms that is fitted to a dataset [deg].

    It is 0 if the garment was also settled in poses with hanging arms as they were recorded, and today's angle if the
    dataset does not tell.

    Raises:
        BadDataset: Some arms were lifted by one angle and some by another.
    """
    lifts = arm_lifts_deg(dataset)
    if len(lifts - {0.0}) > 1:
        got = " and ".join(f"{angle:g}" for angle in sorted(lifts - {0.0})) + " degrees"
        cure = "drape into a new folder, all with the same version of hemline"
        raise BadDataset(f"hanging arms were lifted by different angles in {dataset.folder}", got, cure)
    return min(lifts, default=LIFT_DEG)
