// One garment on the body, frame by frame: pose, skin, animate, push out of the body. As `playback.Player`, but for what
// comes after the animator: whole-cloth step, cover and projection are left out, a light push is in their place.

import { AgentDress } from "hemline/agentdress.js";
import { part } from "hemline/container.js";
import { runUp } from "hemline/motion.js";
import { Ropes } from "hemline/ropes.js";

const ANIMATORS = { ropes: Ropes, agentdress: AgentDress };
const PRE_ROLL = 1, GAP = 0.003, DEEPEST = 0.06, TURNS = 32;

export class Player {
  constructor(index, contents, body, kernels) {
    const arrays = part(contents.arrays, `models.${index}`);
    Object.assign(this, { body, kernels, metadata: contents.metadata.models[index] });
    this.animator = new ANIMATORS[this.metadata.animator](arrays, this.metadata, kernels);
    this.count = arrays.rest.length / 3;
    this.faces = kernels.wordsOf(arrays.faces);
    this.vertices = kernels.floats(3 * this.count);
    this.normals = kernels.floats(3 * this.count);
    this.nearest = kernels.wordsOf(arrays.nearest);
    this.settled = this.nearest.slice();
    this.turn = -1;
  }

  /** The state before a clip's frame at a time [s], in which the garment has settled. */
  start(clip, seconds, dt) {
    const first = clip.at(seconds), second = seconds === 0 && clip.count > 1 ? this.#onward(clip, first, dt) : null;
    const poses = runUp(this.body, first, second, Math.round(PRE_ROLL / dt), dt);
    this.body.pose(poses[0]);
    let state = this.animator.start(this.body);
    for (const pose of poses.slice(1)) {
      this.body.pose(pose);
      state = this.animator.advance(state, this.body, dt);
    }
    this.nearest.set(this.settled);
    this.turn = -1; // all seek anew
    return state;
  }

  /** The state at a pose, `dt` later [s]; the vertices are in `vertices`, those of the body in `body.vertices`. */
  step(state, pose, dt, { pushing = true } = {}) {
    const { body, animator, kernels, vertices } = this, began = performance.now();
    body.pose(pose);
    body.skin();
    const skinned = performance.now(), after = animator.advance(state, body, dt);
    animator.show(body, vertices);
    const animated = performance.now();
    if (pushing) {
      animator.limits?.limit(vertices, animator.rest);
      this.#push();
    }
    const done = performance.now();
    this.milliseconds = { body: skinned - began, animator: animated - skinned, push: done - animated, all: done - began };
    return after;
  }

  /** Normals of the garment, weighted by area: for the picture. */
  shade() {
    const { faces, vertices, normals, count } = this;
    this.kernels.areaNormals(faces.byteOffset, vertices.byteOffset, faces.length / 3, count, normals.byteOffset);
  }

  #push() {
    const { starts, around, samples, vertices: skin, normals } = this.body;
    this.kernels.push(
      starts.byteOffset, around.byteOffset, samples.byteOffset, samples.length, this.turn, skin.byteOffset,
      normals.byteOffset, GAP, DEEPEST, this.count, this.nearest.byteOffset, this.vertices.byteOffset,
    );
    this.turn = (this.turn + 1) % TURNS;
  }

  /** Where the pelvis is `dt` after a clip's start, to whose speed the body runs up. */
  #onward(clip, first, dt) {
    const next = clip.frame(1).translation;
    const translation = first.translation.map((place, c) => place + (next[c] - place) * Math.fround(dt * clip.fps));
    return { rotations: first.rotations, translation };
  }
}
