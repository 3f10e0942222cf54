"""The angle by which hanging arms were lifted in the poses that a garment was settled in."""

from hemline.bodies.lifted_arms import FORMER_LIFT_DEG
from hemline.errors import BadDataset

from .dataset import Dataset
from .take import take_metadata


def arm_lift_deg(dataset: Dataset) -> float | None:
    """Returns the angle by which hanging arms were lifted in the poses of a dataset [deg]; None if it has no such pose.

    Raises:
        BadDataset: It differs between its takes.
    """
    inputs = [take_metadata(dataset.path(row.name))["inputs"] for row in dataset.rows() if row.kind == "anchor"]
    found = sorted({float(each.get("lift_deg", FORMER_LIFT_DEG)) for each in inputs if "protocol" in each})
    if len(found) > 1:
        got = " and ".join(f"{angle:g}" for angle in found) + " degrees"
        cure = "drape into a new folder, all with the same version of hemline"
        raise BadDataset(f"hanging arms were lifted by different angles in {dataset.folder}", got, cure)
    return found[0] if found else None
