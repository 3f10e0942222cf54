"""Plays the cape in a game loop of one's own: with a varying frame time, a rollback, and three bodies at once.

A state is plain data that is never changed in place, so a rollback keeps an old state. Run it:
`python examples/01_game_loop.py`.
"""

import numpy as np

import hemline

body = hemline.bodies.load("anny24").shaped()
cape = hemline.load("cape")
turn = hemline.motions.load("turn")  # the player scales it to the body's legs and puts its feet on the ground
rng = np.random.default_rng(0)

player = hemline.Player.prepare(cape, body)
seconds, state = 0.0, player.start(turn.at(0.0))
for number in range(120):
    dt = float(rng.uniform(1 / 120, 1 / 24))
    seconds += dt
    state, frame = player.step(state, turn.at(seconds), dt=dt)
    if number == 60:
        snapshot = (state, seconds, frame)

state, seconds, earlier = snapshot  # the game's server asks to go back to this moment
state, frame = player.step(state, turn.at(seconds + 1 / 60), dt=1 / 60)
moved = np.abs(frame.vertices - earlier.vertices).max()
print(f"rolled back to {seconds:.2f} s; a vertex moved by up to {moved * 100:.1f} cm in the next frame")

bodies = [hemline.bodies.load("anny24").shaped(betas) for betas in ([0.0], [1.0], [0.0, 1.0])]
players = [hemline.Player.prepare(cape, body) for body in bodies]
states = [player.start(turn.at(0.0)) for player in players]
states, frames = hemline.crowd(players, states, [turn.at(1 / 60)] * 3, dt=1 / 60)
print(f"{len(frames)} bodies at once, {len(frames[0].vertices)} vertices each")
