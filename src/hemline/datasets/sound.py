"""Leaves takes out of a fit that are no ground truth."""

import warnings
from dataclasses import replace

from hemline.errors import HemlineWarning

from .collection import Collection
from .dataset import Dataset
from .row import Row


def leave_out_faulty(data: Dataset | Collection) -> Dataset | Collection:
    """Returns data without the clips and anchors in which a limb is through the cloth, or the cloth is torn.

    If all clips of a dataset are faulty, or all anchors, these are kept, since there is nothing else to fit to.

    Args:
        data: A dataset, or several.

    Warns:
        HemlineWarning: Takes are left out, or kept in spite of their faults; one line with the counts.
    """
    datasets = data.datasets if isinstance(data, Collection) else (data,)
    left_out: list[list[Row]] = []
    faulty_only: list[Row] = []
    total = 0
    for each in datasets:
        kinds = [each.clips(), each.anchors()]
        faulty = [[row for row in rows if row.faults.reason] for rows in kinds]
        total += sum(len(rows) for rows in kinds)
        left_out.append([row for rows, bad in zip(kinds, faulty, strict=True) for row in bad if len(bad) < len(rows)])
        faulty_only += [row for rows, bad in zip(kinds, faulty, strict=True) for row in bad if len(bad) == len(rows)]
    out = [row for rows in left_out for row in rows]
    folders = ", ".join(str(each.folder) for each in datasets[:3]) + (" and others" if len(datasets) > 3 else "")
    if faulty_only:
        what = f"all takes of a kind in {folders} have faults, and the fit learns them"
        _warn(what, faulty_only, total, "simulate other clips")
    if not out:
        return data
    what = f"takes of {folders} are left out of the fit"
    _warn(what, out, total, "simulate other clips if too few are left")
    sound = tuple(
        replace(each, left_out=each.left_out | {row.name for row in rows})
        for each, rows in zip(datasets, left_out, strict=True)
    )
    return Collection(sound) if isinstance(data, Collection) else sound[0]


def _warn(what: str, rows: list[Row], total: int, cure: str) -> None:
    through = sum(row.faults.is_through for row in rows)
    torn = len(rows) - through
    parts = [f"in {through} a limb is through the cloth"] * bool(through) + [f"in {torn} it is torn"] * bool(torn)
    warnings.warn(HemlineWarning(what, f"{len(rows)} of {total}: {', '.join(parts)}", cure), stacklevel=1)
