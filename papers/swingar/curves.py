"""Draws the training curves of a fit as PNG and JSON: `python -m papers.swingar.curves CHECKPOINTS -o curves`.

CHECKPOINTS is the folder that `hemline fit` keeps beside its model, with a file for each stage of the training.
"""

import argparse
import json
import sys
from pathlib import Path

from hemline.errors import BadInput, BadModel, HemlineError
from hemline.files import read_tensors


def curves_of(folder: Path) -> dict[str, dict[str, list[float]]]:
    """Reads the validation loss at the start and after each epoch, and the mean loss of each epoch, by stage."""
    found = {}
    for path in sorted(folder.glob("*.safetensors")):
        arrays, _ = read_tensors(path, "training", error=BadModel)
        found[path.stem] = {name: arrays[name].tolist() for name in ("losses", "trained") if name in arrays}
    if not found:
        raise BadInput("CHECKPOINTS must hold the state of a training", folder, "give a folder that `hemline fit` kept")
    return found


def draw(curves: dict[str, dict[str, list[float]]], path: Path) -> None:
    """Draws two plots of each stage, validation loss and loss of the batches, which have different units."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.ticker import MaxNLocator

    figure, axes = plt.subplots(2, len(curves), figsize=(5 * len(curves), 5), squeeze=False, sharex="col")
    for column, (stage, each) in zip(axes.T, curves.items(), strict=True):
        kinds = {"held out": list(enumerate(each["losses"])), "batches": list(enumerate(each.get("trained", []), 1))}
        for axis, (name, points) in zip(column, kinds.items(), strict=True):
            axis.plot(*zip(*points, strict=True) if points else ([], []), marker=".")
            axis.set(ylabel=f"loss, {name}", ylim=(0, 1.1 * max([loss for _, loss in points], default=1.0)))
            axis.xaxis.set_major_locator(MaxNLocator(integer=True))
        column[0].set(title=stage)
        column[1].set(xlabel="epoch")
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def main() -> None:
    """Reads checkpoints, and draws and writes the curves."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoints", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True, help="without an ending: .json and .png are written")
    args = parser.parse_args()
    try:
        curves = curves_of(args.checkpoints)
    except HemlineError as error:
        sys.exit(f"curves: {error}")
    draw(curves, args.out.with_suffix(".png"))
    args.out.with_suffix(".json").write_text(json.dumps(curves, indent=1) + "\n")


if __name__ == "__main__":
    main()
