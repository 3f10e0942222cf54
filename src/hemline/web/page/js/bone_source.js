// Source of the bones: ropes, corrected, without tremor, no farther apart than cloth is; animators/ropes/bones/bone_source, tracker.

import { rigidBetween } from "hemline/chains.js";
import { intoJoint, point, toWorld } from "hemline/joint_frames.js";

const ROPES_STRETCH = 1.1, PAIRS_STRETCH = 1.02, LIMIT_SWEEPS = 4, SMOOTHING_SECONDS = 0.1;
const TRACKING_SECONDS = 0.048, SWING_SECONDS = 0.7;

/** Makes displacements of all bones from rest, in the frame of the key joint. States are never changed in place. */
export class BoneSource {
  constructor(chains, correction, restBones) {
    Object.assign(this, { chains, correction, rest: restBones });
    this.free = Array.from(chains.parents.keys()).filter((node) => chains.parents[node] >= 0);
  }

  start(frames) {
    const ropes = this.chains.start(frames), positions = ropes.positions.slice();
    const change = new Float32Array(this.rest.length), velocities = new Float64Array(positions.length);
    return { ropes, change, positions, velocities, mean: change.slice() };
  }

  /** Returns the state `dt` later [s] and the displacements, float32. */
  step(state, frames, dt) {
    const { chains, rest, free } = this, ropes = chains.step(state.ropes, frames, dt);
    let before = state.ropes.frames, { positions, velocities } = state;
    if (chains.isMoment(state.ropes, frames, dt) || chains.teleported(before, frames, dt)) {
      const move = rigidBetween(before, frames, chains.key);
      positions = move.points(positions), velocities = move.vectors(velocities), before = frames;
    } else positions = positions.slice(), velocities = velocities.slice();
    const local = intoJoint(frames, chains.key, ropes.positions);
    const wanted = this.correction.change(Float32Array.from(local, (value, n) => value - rest[n]), before, frames, dt);
    const share = Math.fround(-Math.expm1(-dt / SMOOTHING_SECONDS)), theta = Math.exp(-dt / TRACKING_SECONDS);
    const change = state.change.map((value, n) => value + share * (wanted[n] - value));
    for (const node of free) {
      const [x, y, z] = [0, 1, 2].map((d) => local[3 * node + d] + change[3 * node + d]);
      toWorld(frames, chains.key, x, y, z);
      for (let d = 0; d < 3; d++) {
        const n = 3 * node + d, ahead = positions[n] + dt * velocities[n], missing = point[d] - ahead;
        positions[n] = ahead + (1 - theta ** 2) * missing;
        velocities[n] += ((1 - theta) ** 2 / dt) * missing;
      }
    }
    const shown = intoJoint(frames, chains.key, positions);
    for (const node of free) local.set(shown.subarray(3 * node, 3 * node + 3), 3 * node);
    const moved = Float32Array.from(local, (value, n) => value - rest[n]), slow = Math.fround(-Math.expm1(-dt / SWING_SECONDS));
    const mean = state.mean.map((value, n) => value + slow * (moved[n] - value));
    const more = Math.fround(this.correction.swingGain - 1);
    for (const node of free) for (let n = 3 * node; n < 3 * node + 3; n++) moved[n] += more * (moved[n] - mean[n]);
    return [{ ropes, change, positions, velocities, mean }, this.#limit(moved)];
  }

  /** Returns displacements with bones moved together as far as the cloth requires. */
  #limit(moved) {
    const { parents, lengths, pairs, pairSpans } = this.chains, positions = this.rest.map((place, n) => place + moved[n]);
    let worst = 0;
    for (let sweep = 0; sweep < LIMIT_SWEEPS; sweep++) {
      for (let k = 0; k < pairs.length; k += 2) {
        const a = pairs[k], b = pairs[k + 1], most = PAIRS_STRETCH * pairSpans[k + 1];
        const [x, y, z, span] = apart(positions, a, b), forA = parents[a] >= 0 ? 1 : 0, forB = parents[b] >= 0 ? 1 : 0;
        if (span <= most || forA + forB === 0) continue;
        if (sweep === 0) worst = Math.max(worst, span / most - 1);
        const pull = (span - most) / (span * (forA + forB));
        [x, y, z].forEach((component, d) => {
          positions[3 * a + d] += forA * pull * component;
          positions[3 * b + d] -= forB * pull * component;
        });
      }
      for (let i = 0; i < parents.length; i++) {
        if (parents[i] < 0) continue;
        const most = ROPES_STRETCH * lengths[i], [x, y, z, span] = apart(positions, parents[i], i);
        if (span <= most) continue;
        if (sweep === 0) worst = Math.max(worst, span / most - 1);
        [x, y, z].forEach((component, d) => (positions[3 * i + d] = positions[3 * parents[i] + d] + (most / span) * component));
      }
      if (worst === 0) break;
    }
    return worst === 0 ? moved : moved.map((_, n) => positions[n] - this.rest[n]);
  }
}

function apart(positions, a, b) {
  const x = positions[3 * b] - positions[3 * a], y = positions[3 * b + 1] - positions[3 * a + 1];
  const z = positions[3 * b + 2] - positions[3 * a + 2];
  return [x, y, z, Math.sqrt(x * x + y * y + z * z)];
}
