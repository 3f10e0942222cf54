"""Plays the shipped cape on the shipped run and writes a file for Blender.

Body, model and motion ship with the package. Run it: `python examples/00_hello_cape.py`.
"""

from pathlib import Path

import hemline

body = hemline.bodies.load("anny24").shaped(betas=[0.5, -1.0])
cape = hemline.load("cape")
run = hemline.motions.load("run")

frames = list(hemline.play(cape, body, run, fps=30, measure=True))
inside = sum(frame.report.inside_before for frame in frames)
print(
    f"{len(frames)} frames of {len(frames[0].vertices)} vertices; {inside} were inside the body and have been moved out"
)

clip = hemline.record(frames, garment_name="cape", garment_faces=cape.garment.faces, motion=run, fps=30)
for path in hemline.export.write(Path("hello_cape.glb"), clip):
    print(path)
