"""Plays twenty capes at levels of detail that depend on the distance from the camera.

One player per level serves all people of that shape; their motion is in the states. When somebody comes nearer,
`switch_to` converts the state, so that the cloth does not jump. Run it: `python examples/02_crowd.py`.
"""

import time
from collections import Counter

import numpy as np

import hemline

PEOPLE, FRAMES, DT = 20, 30, 1 / 30

body = hemline.bodies.load("anny24").shaped()
cape = hemline.load("cape")
clips = [hemline.motions.load(name) for name in ("walk", "run", "turn", "dance")]
players = {detail: hemline.Player.prepare(cape, body, detail=detail) for detail in (1.0, 0.5, 0.25, 0.1)}
errors = {detail: player.error for detail, player in players.items()}
for player in players.values():
    player.warm_up(clips[0][0])

places = np.random.default_rng(0).uniform([-10, -30], [10, 0], (PEOPLE, 2))  # x and z of each person [m]
camera = np.array([0.0, 4.0])  # moves towards them at 3 m/s
motion = [clips[person % len(clips)] for person in range(PEOPLE)]


def level(person: int) -> float:
    """Returns the coarsest level with an error below half a pixel."""
    return hemline.detail_for(float(np.linalg.norm(places[person] - camera)), errors, height_px=1080)


levels = [level(person) for person in range(PEOPLE)]
states = [players[levels[person]].start(motion[person][0]) for person in range(PEOPLE)]
spans, changes = [], 0
for number in range(FRAMES):
    camera = camera - [0.0, 3.0 * DT]
    began = time.perf_counter()
    for person in range(PEOPLE):
        wanted = level(person)
        if wanted != levels[person]:
            states[person] = players[levels[person]].switch_to(states[person], players[wanted])
            levels[person], changes = wanted, changes + 1
    poses = [clip[number] for clip in motion]
    states, frames = hemline.crowd([players[detail] for detail in levels], states, poses, dt=DT)
    # draw(frames[person].vertices + place, players[levels[person]].garment.faces)
    spans.append((time.perf_counter() - began) * 1e3)

counts = Counter(levels)
print("people at each level:", {detail: counts[detail] for detail in players})
print(f"{np.median(spans):.1f} ms a frame for {PEOPLE} capes; {changes} changes of level")
