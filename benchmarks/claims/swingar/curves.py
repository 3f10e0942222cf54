"""Training curves of a fit as PNG and JSON: `python benchmarks/claims/swingar/curves.py CHECKPOINTS -o curves`.

CHECKPOINTS is the folder that `hemline fit` keeps beside its model: a file for each stage of the training.
"""

import argparse
import json
from pathlib import Path

from hemline.errors import BadInput, BadModel
from hemline.files import read_tensors


def curves_of(folder: Path) -> dict[str, dict[str, list[float]]]:
    """By stage: the validation loss at the start and after each epoch, the mean loss of the batches of each."""
    found = {}
    for path in sorted(folder.glob("*.safetensors")):
        arrays, _ = read_tensors(path, "training", error=BadModel)
        found[path.stem] = {name: arrays[name].tolist() for name in ("losses", "trained") if name in arrays}
    if not found:
        raise BadInput("CHECKPOINTS must hold the state of a training", folder, "give a folder that `hemline fit` kept")
    return found


def draw(curves: dict[str, dict[str, list[float]]], path: Path) -> None:
    """A plot of each stage."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, len(curves), figsize=(5 * len(curves), 3.2), squeeze=False)
    for axis, (stage, each) in zip(axes[0], curves.items(), strict=True):
        axis.plot(each["losses"], label="held out")
        if each.get("trained"):
            axis.plot(range(1, len(each["trained"]) + 1), each["trained"], label="trained")
        axis.set(title=stage, xlabel="epoch", ylabel="loss", yscale="log")
        axis.legend()
    figure.tight_layout()
    figure.savefig(path, dpi=100)


def main() -> None:
    """Read, draw, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("checkpoints", type=Path)
    parser.add_argument("-o", "--out", type=Path, required=True, help="without an ending: .json and .png are written")
    args = parser.parse_args()
    curves = curves_of(args.checkpoints)
    draw(curves, args.out.with_suffix(".png"))
    args.out.with_suffix(".json").write_text(json.dumps(curves, indent=1) + "\n")


if __name__ == "__main__":
    main()
