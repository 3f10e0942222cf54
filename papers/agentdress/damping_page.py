"""The page and the picture of `damping.py`."""

from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]

from papers.rope_chains.drawing.figure import axes, keep  # noqa: E402

PAGES = ROOT / "papers" / "agentdress" / "pages"
FPS = 30.0
MOST_JERK = 1.5
PAGE = """\
# How quickly the garment follows the pose

Written by `python -m papers.agentdress.damping MODEL TRUTH` at commit {commit}, on {machine}, one thread;
{garment} on {clips}, the mean shape. Eq. 9 and Fig. 3 of the appendix of Wu et al. 2021: joints follow
the pose with a damping ratio, here a time constant; the ratio beside it is that of 30 frames a second.

![residual and jerk against the time constant](damping.png)

Means over the clips and every sixth frame. "Residual": the force that is left on what is shown (membrane, bending,
gravity, contact): on the median vertex, over the weight of a vertex, and the norm of all of them, the paper's measure,
which a few torn triangles decide. Simulated garments, which move, have {simulated:.1f} weights and {simulated_n:.1f} N.
"Jerk": over that of the simulation; "worst": of the clips. "Apart": mean distance from what plays without decay.
"Late": the shift in time at which what is added to skinning agrees best with that.

| time constant, s | ratio | residual, weights | norm, N | jerk / simulated (worst) | error, mm | apart, mm | late, ms |
|---|---|---|---|---|---|---|---|
{table}

The paper chooses the largest damping ratio that keeps the residual low; it gives neither curve nor value as numbers.
Low: no more than {low:.0f} % above the least, on the median vertex. That gives {chosen:g} s; the default is {default:g}
s, which errs least: where a recorded arm twists by 40 degrees a frame, what lags tears the sleeve.
Jerk, asked at most {most:g} times the simulation's: {jerk:.2f} with the default (worst clip {worst:.2f}).

| clip | simulated residual, weights | residual, weights | jerk / simulated | error, mm | late, ms |
|---|---|---|---|---|---|
{by_clip}

The second table is with the default.
"""


def _mean(row: dict, name: str) -> float:
    return float(np.mean([each[name] for each in row["clips"]]))


def _line(row: dict) -> str:
    seconds = row["decay_seconds"]
    ratio = float(np.exp(-1 / (FPS * seconds))) if seconds else 0.0
    worst = max(each["jerk_ratio"] for each in row["clips"])
    return (
        f"| {seconds:g} | {ratio:.2f} | {_mean(row, 'residual_weights'):.1f} | {_mean(row, 'residual_n'):.0f} | "
        f"{_mean(row, 'jerk_ratio'):.2f} ({worst:.2f}) | {_mean(row, 'error_mm'):.2f} | {_mean(row, 'apart_mm'):.2f} | "
        f"{_mean(row, 'late_ms'):.0f} |"
    )


def write(rows: list[dict], chosen: float, default: float, low: float) -> None:
    """Write page and picture anew.

    Args:
        rows: One a time constant, the first one without decay.
        chosen: The time constant that the residual chooses [s].
        default: That of the model [s].
        low: Up to how many times the least residual one is low.
    """
    sheet, (plots,) = axes(1, 3, width=3.4, height=3.0)
    seconds = [row["decay_seconds"] for row in rows]
    for plot, name, title in zip(
        plots,
        ("residual_weights", "jerk_ratio", "error_mm"),
        ("residual, weights", "jerk / simulated", "error, mm"),
        strict=True,
    ):
        plot.plot(seconds, [_mean(row, name) for row in rows], "o-", ms=3)
        plot.axvline(chosen, color="tab:green", lw=0.8, label="chosen by the residual")
        plot.axvline(default, color="grey", ls=":", label="default")
        plot.set(xlabel="time constant, s", ylabel=title)
    plots[0].legend(fontsize=6)
    keep(sheet, PAGES, "damping.png")
    plain = rows[0]
    played = next((row for row in rows if row["decay_seconds"] == default), plain)
    by_clip = [
        f"| {one['clip']} | {none['simulated_residual_weights']:.1f} | {one['residual_weights']:.1f} | "
        f"{one['jerk_ratio']:.2f} | {one['error_mm']:.2f} | {one['late_ms']:.0f} |"
        for one, none in zip(played["clips"], plain["clips"], strict=True)
    ]
    page = PAGE.format(
        table="\n".join(_line(row) for row in rows),
        by_clip="\n".join(by_clip),
        clips=", ".join(each["clip"] for each in plain["clips"]),
        simulated=_mean(plain, "simulated_residual_weights"),
        simulated_n=_mean(plain, "simulated_residual_n"),
        jerk=_mean(played, "jerk_ratio"),
        worst=max(each["jerk_ratio"] for each in played["clips"]),
        low=100 * (low - 1),
        chosen=chosen,
        default=default,
        most=MOST_JERK,
        **{key: plain[key] for key in ("commit", "machine", "garment")},
    )
    (PAGES / "damping.md").write_text(page)
