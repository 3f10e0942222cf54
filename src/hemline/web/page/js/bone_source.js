// Source of the bones: ropes, corrected, no farther apart than cloth is; animators/ropes/bones/bone_source.

import { intoJoint } from "hemline/joint_frames.js";

const ROPES_STRETCH = 1.1, PAIRS_STRETCH = 1.02, LIMIT_SWEEPS = 4, SMOOTHING_SECONDS = 0.1;

/** Makes displacements of all bones from rest, in the frame of the key joint. States are never changed in place. */
export class BoneSource {
  constructor(chains, correction, restBones) {
    Object.assign(this, { chains, correction, rest: restBones });
  }

  start(frames) {
    return { ropes: this.chains.start(frames), change: new Float32Array(this.rest.length) };
  }

  /** Returns the state `dt` later [s] and the displacements, float32. */
  step(state, frames, dt) {
    const { chains, rest } = this, ropes = chains.step(state.ropes, frames, dt), before = state.ropes.frames;
    const moved = Float32Array.from(intoJoint(frames, chains.key, ropes.positions), (value, n) => value - rest[n]);
    const wanted = this.correction.change(moved, chains.teleported(before, frames, dt) ? frames : before, frames, dt);
    const share = Math.fround(-Math.expm1(-dt / SMOOTHING_SECONDS));
    const change = state.change.map((value, n) => value + share * (wanted[n] - value));
    return [{ ropes, change }, this.#limit(moved.map((value, n) => value + change[n]))];
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
