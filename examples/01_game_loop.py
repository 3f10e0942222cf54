"""Step the cape inside one's own loop, with a varying frame time, and roll back.

A State is plain data that is never changed in place: keeping the old one is a rollback. Run it:
`python examples/01_game_loop.py`.
"""

import numpy as np

import hemline

body = hemline.bodies.load("anny24").shaped()
cape = hemline.load("cape")
motion = body.placed(hemline.motions.load("turn"))
rng = np.random.default_rng(0)

seconds, state = 0.0, cape.start(body.posed(motion.at(0.0)))
saved = None
for frame in range(120):
    dt = float(rng.uniform(1 / 120, 1 / 24))
    seconds += dt
    state, vertices = cape.step(state, body.posed(motion.at(seconds)), dt)
    if frame == 60:
        saved = (state, seconds, vertices)

state, seconds, then = saved
again, vertices = cape.step(state, body.posed(motion.at(seconds + 1 / 60)), 1 / 60)
print(
    f"rolled back to {seconds:.2f} s; the hem is {np.abs(vertices - then).max() * 100:.1f} cm further after one frame"
)
