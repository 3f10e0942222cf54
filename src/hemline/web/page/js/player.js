// One garment on the body, frame by frame: pose, skin, animate, push out of the body. Unlike `playback.Player` it has a
// light push in place of whole-cloth step, cover and projection.

import { AgentDress } from "hemline/agentdress.js";
import { part } from "hemline/container.js";
import { runUp } from "hemline/motion.js";
import { Ropes } from "hemline/ropes.js";

const ANIMATORS = { ropes: Ropes, agentdress: AgentDress };
const PRE_ROLL = 1, GAP = 0.003, DEEPEST = 0.06, SEARCH_INTERVAL = 32;

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
    this.initialNearest = this.nearest.slice();
    this.round = -1;
  }

  /** Returns the settled state before the frame of a clip at a time [s]. */
  start(clip, seconds, dt) {
    const first = clip.at(seconds), second = seconds === 0 && clip.count > 1 ? this.#secondPose(clip, first, dt) : null;
    const poses = runUp(this.body, first, second, Math.round(PRE_ROLL / dt), dt);
    this.body.pose(poses[0]);
    let state = this.animator.start(this.body);
    for (const pose of poses.slice(1)) {
      this.body.pose(pose);
      state = this.animator.advance(state, this.body, dt);
    }
    this.nearest.set(this.initialNearest);
    this.round = -1; // every vertex searches anew
    return state;
  }

  /** Returns the state at a pose, `dt` later [s]; vertices are in `vertices` and `body.vertices`. */
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

  /** Computes area-weighted normals of the garment, for the picture. */
  shade() {
    const { faces, vertices, normals, count } = this;
    this.kernels.areaNormals(faces.byteOffset, vertices.byteOffset, faces.length / 3, count, normals.byteOffset);
  }

  #push() {
    const { starts, around, samples, vertices: skin, normals } = this.body;
    this.kernels.push(
      starts.byteOffset, around.byteOffset, samples.byteOffset, samples.length, this.round, skin.byteOffset,
      normals.byteOffset, GAP, DEEPEST, this.count, this.nearest.byteOffset, this.vertices.byteOffset,
    );
    this.round = (this.round + 1) % SEARCH_INTERVAL;
  }

  /** Returns the pose `dt` after the start of a clip, to whose speed the body accelerates. */
  #secondPose(clip, first, dt) {
    const next = clip.frame(1).translation;
    const translation = first.translation.map((place, c) => place + (next[c] - place) * Math.fround(dt * clip.fps));
    return { rotations: first.rotations, translation };
  }
}
