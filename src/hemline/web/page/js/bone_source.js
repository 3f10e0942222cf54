// Source of the bones: ropes, learned bones, or a smooth transition between both; animators/ropes/bone_source.

import { rigidBetween } from "hemline/chains.js";
import { intoJoint } from "hemline/joint_frames.js";

const GRAVITY = [0, -9.81, 0], BEYOND_LOW = 0.1, BEYOND_HIGH = 0.3, ROPES_STRETCH = 1.1, PAIRS_STRETCH = 1.02, LIMIT_SWEEPS = 4;
const SECONDS_TO_ROPES = 0.5, SECONDS_TO_LEARNED = 2, SECONDS_TO_FOLLOW = 0.1;

/** Makes displacements of all bones from rest, in the frame of the key joint. States are never changed in place. */
export class BoneSource {
  constructor(chains, correction, learned, restBones) {
    Object.assign(this, { chains, correction, learned, rest: restBones });
    this.free = Array.from(chains.parents.keys()).filter((node) => chains.parents[node] >= 0);
  }

  /** Whether there is a force that learned bones were not trained with. */
  get unknownForces() {
    const { wind, gravity } = this.chains.constants;
    return wind.some((each) => each !== 0) || gravity.some((each, d) => each !== GRAVITY[d]);
  }

  start(frames) {
    const ropes = this.chains.start(frames);
    const learned = this.learned && this.learned.start(this.#freeOf(ropes.positions), frames);
    return { ropes, learned, fraction: this.unknownForces ? 1 : 0 };
  }

  /** Returns the state `dt` later [s] and the displacements, float32. */
  step(state, frames, dt) {
    const { chains } = this;
    if (!this.learned) {
      const ropes = chains.step(state.ropes, frames, dt);
      const moved = this.#correct(ropes, state.ropes.frames, frames, dt);
      return [{ ropes, learned: null, fraction: state.fraction }, this.#limitDisplacements(moved)];
    }
    let before = state.learned;
    if (chains.teleported(before.bodies[2], frames, dt)) before = followTeleport(before, frames, chains.key);
    const result = this.learned.step(before, frames, dt), positions = new Float64Array(3 * chains.count);
    const put = (nodes, values) => nodes.forEach((node, k) => positions.set(values.subarray(3 * k, 3 * k + 3), 3 * node));
    put(chains.kinematic, chains.kinematicPositions(frames));
    put(this.free, result.positions);
    this.#limitResult(result, positions);
    const fraction = this.#nextFraction(state.fraction, result.beyond, dt);
    let { ropes } = state;
    if (state.fraction > 0) ropes = chains.step(ropes, frames, dt);
    else if (fraction > 0) ropes = this.#ropesFrom(result, frames, before, dt);
    let moved = this.#displacements(positions, frames), learned = result.state;
    if (fraction > 0) {
      const weight = Math.fround(fraction * fraction * (3 - 2 * fraction));
      const corrected = this.#correct(ropes, before.bodies[2], frames, dt);
      moved = this.#limitDisplacements(moved.map((value, n) => (1 - weight) * value + weight * corrected[n]));
      learned = this.#drawToRopes(result, ropes, fraction, dt);
    }
    return [{ ropes, learned, fraction }, moved];
  }

  #freeOf(positions) {
    const out = new Float64Array(3 * this.free.length);
    this.free.forEach((node, k) => out.set(positions.subarray(3 * node, 3 * node + 3), 3 * k));
    return out;
  }

  /** Limits the distances between learned bones to those that the cloth allows. */
  #limitResult(result, positions) {
    if (this.#limit(positions) === 0) return;
    result.positions = this.#freeOf(positions);
    if (result.state.elapsed === 0) result.state = { ...result.state, positions: [result.state.positions[0], result.positions] };
  }

  #limitDisplacements(moved) {
    const positions = this.rest.map((place, n) => place + moved[n]);
    return this.#limit(positions) === 0 ? moved : moved.map((_, n) => positions[n] - this.rest[n]);
  }

  /** Moves bones together as far as the cloth requires, in place; returns the largest excess before. */
  #limit(positions) {
    const { parents, lengths, pairs, pairSpans } = this.chains;
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
    return worst;
  }

  #nextFraction(now, beyond, dt) {
    const wanted = this.unknownForces ? 1 : Math.min(Math.max((beyond - BEYOND_LOW) / (BEYOND_HIGH - BEYOND_LOW), 0), 1);
    return now + Math.min(Math.max(wanted - now, -dt / SECONDS_TO_LEARNED), dt / SECONDS_TO_ROPES);
  }

  /** Returns the state of ropes with positions and velocities of the learned bones. */
  #ropesFrom(result, frames, before, dt) {
    const state = this.chains.start(frames), { kinematic } = this.chains, velocities = new Float64Array(3 * this.chains.count);
    const last = this.chains.kinematicPositions(before.bodies[2]), rates = new Float64Array(last.length);
    this.free.forEach((node, k) => {
      state.positions.set(result.positions.subarray(3 * k, 3 * k + 3), 3 * node);
      velocities.set(result.velocities.subarray(3 * k, 3 * k + 3), 3 * node);
    });
    kinematic.forEach((node, k) => {
      for (let d = 0; d < 3; d++) {
        rates[3 * k + d] = (state.positions[3 * node + d] - last[3 * k + d]) / dt;
        velocities[3 * node + d] = rates[3 * k + d];
      }
    });
    return { ...state, velocities, kinematicVelocities: rates, kinematicRates: rates.slice(), lastDt: dt };
  }

  /** Returns learned bones drawn towards the ropes, faster with a larger fraction of ropes. */
  #drawToRopes(result, ropes, fraction, dt) {
    const now = this.#freeOf(ropes.positions), speed = this.#freeOf(ropes.velocities), back = result.state.elapsed;
    const weight = fraction === 1 ? 1 : 1 - Math.exp((-fraction * dt) / SECONDS_TO_FOLLOW);
    const positions = [back + this.learned.seconds, back].map((earlier, which) => {
      return result.state.positions[which].map((value, n) => (1 - weight) * value + weight * (now[n] - speed[n] * earlier));
    });
    return { ...result.state, positions };
  }

  #displacements(positions, frames) {
    return Float32Array.from(intoJoint(frames, this.chains.key, positions), (value, n) => value - this.rest[n]);
  }

  #correct(ropes, before, frames, dt) {
    const then = this.chains.teleported(before, frames, dt) ? frames : before;
    const moved = this.#displacements(ropes.positions, frames), change = this.correction.change(moved, then, frames, dt);
    return moved.map((value, n) => value + change[n]);
  }
}

/** Returns the state of learned bones, with its past, moved rigidly with the key joint. */
function followTeleport(state, frames, key) {
  const move = rigidBetween(state.bodies[2], frames, key), from = state.bodies[2], f = 12 * key;
  const bodies = state.bodies.map((body) => {
    const out = new Float64Array(body.length);
    for (let n = 0; n < body.length; n++) {
      const first = n - (n % 12), row = Math.floor((n % 12) / 4), column = n % 4;
      for (let c = 0; c < 3; c++) {
        const away = column === 3 ? from[f + 4 * c + 3] : 0;
        out[n] += move.turn[3 * row + c] * (body[first + 4 * c + column] - away);
      }
      if (column === 3) out[n] += frames[f + 4 * row + 3];
    }
    return out;
  });
  return { ...state, positions: state.positions.map(move.points), bodies };
}

function apart(positions, a, b) {
  const x = positions[3 * b] - positions[3 * a], y = positions[3 * b + 1] - positions[3 * a + 1];
  const z = positions[3 * b + 2] - positions[3 * a + 2];
  return [x, y, z, Math.sqrt(x * x + y * y + z * z)];
}
