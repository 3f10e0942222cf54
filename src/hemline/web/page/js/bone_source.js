// Where the bones come from: ropes, learned bones, or a smooth change between them; animators/ropes/bone_source.

import { rigidBetween } from "hemline/chains.js";
import { intoJoint } from "hemline/joint_frames.js";

const GRAVITY = [0, -9.81, 0], NEAR = 0.1, FAR = 0.3, ROPES_STRETCH = 1.1, PAIRS_STRETCH = 1.02, LIMIT_SWEEPS = 4;
const SECONDS_TO_ROPES = 0.5, SECONDS_TO_LEARNED = 2, SECONDS_TO_FOLLOW = 0.1;

/** Displacements of all bones from rest in the frame of the key joint. States are never changed in place. */
export class BoneSource {
  constructor(chains, correction, learned, restBones) {
    Object.assign(this, { chains, correction, learned, rest: restBones });
    this.free = Array.from(chains.parents.keys()).filter((node) => chains.parents[node] >= 0);
  }

  /** Whether something pulls that learned bones have not seen. */
  get unknownForces() {
    const { wind, gravity } = this.chains.constants;
    return wind.some((each) => each !== 0) || gravity.some((each, d) => each !== GRAVITY[d]);
  }

  start(frames) {
    const ropes = this.chains.start(frames);
    const learned = this.learned && this.learned.start(this.#freeOf(ropes.positions), frames);
    return { ropes, learned, share: this.unknownForces ? 1 : 0 };
  }

  /** The state `dt` later [s] and the displacements, float32. */
  step(state, frames, dt) {
    const { chains } = this;
    if (!this.learned) {
      const ropes = chains.step(state.ropes, frames, dt);
      return [{ ropes, learned: null, share: state.share }, this.#together(this.#corrected(ropes, frames))];
    }
    let shared = state.learned;
    if (chains.jumped(shared.bodies[2], frames, dt)) shared = carriedAlong(shared, frames, chains.key);
    const made = this.learned.step(shared, frames, dt), positions = new Float64Array(3 * chains.count);
    const put = (nodes, values) => nodes.forEach((node, k) => positions.set(values.subarray(3 * k, 3 * k + 3), 3 * node));
    put(chains.kinematic, chains.carried(frames));
    put(this.free, made.positions);
    this.#limitMade(made, positions);
    const share = this.#share(state.share, made.beyond, dt);
    let { ropes } = state;
    if (state.share > 0) ropes = chains.step(ropes, frames, dt);
    else if (share > 0) ropes = this.#takenOver(made, frames, shared, dt);
    let moved = this.#displaced(positions, frames), learned = made.state;
    if (share > 0) {
      const weight = Math.fround(share * share * (3 - 2 * share)), corrected = this.#corrected(ropes, frames);
      moved = this.#together(moved.map((value, n) => (1 - weight) * value + weight * corrected[n]));
      learned = this.#following(made, ropes, share, dt);
    }
    return [{ ropes, learned, share }, moved];
  }

  #freeOf(positions) {
    const out = new Float64Array(3 * this.free.length);
    this.free.forEach((node, k) => out.set(positions.subarray(3 * node, 3 * node + 3), 3 * k));
    return out;
  }

  /** What learned bones made, with bones no farther apart than the cloth allows. */
  #limitMade(made, positions) {
    if (this.#limit(positions) === 0) return;
    made.positions = this.#freeOf(positions);
    if (made.state.elapsed === 0) made.state = { ...made.state, positions: [made.state.positions[0], made.positions] };
  }

  #together(moved) {
    const positions = this.rest.map((place, n) => place + moved[n]);
    return this.#limit(positions) === 0 ? moved : moved.map((_, n) => positions[n] - this.rest[n]);
  }

  /** Bring bones together as far as the cloth asks, in place; the largest excess before. */
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
        [x, y, z].forEach((way, d) => {
          positions[3 * a + d] += forA * pull * way;
          positions[3 * b + d] -= forB * pull * way;
        });
      }
      for (let i = 0; i < parents.length; i++) {
        if (parents[i] < 0) continue;
        const most = ROPES_STRETCH * lengths[i], [x, y, z, span] = apart(positions, parents[i], i);
        if (span <= most) continue;
        if (sweep === 0) worst = Math.max(worst, span / most - 1);
        [x, y, z].forEach((way, d) => (positions[3 * i + d] = positions[3 * parents[i] + d] + (most / span) * way));
      }
      if (worst === 0) break;
    }
    return worst;
  }

  #share(now, beyond, dt) {
    const wanted = this.unknownForces ? 1 : Math.min(Math.max((beyond - NEAR) / (FAR - NEAR), 0), 1);
    return now + Math.min(Math.max(wanted - now, -dt / SECONDS_TO_LEARNED), dt / SECONDS_TO_ROPES);
  }

  /** Ropes where the learned bones are, as fast as those. */
  #takenOver(made, frames, before, dt) {
    const state = this.chains.start(frames), { kinematic } = this.chains, velocities = new Float64Array(3 * this.chains.count);
    const last = this.chains.carried(before.bodies[2]), rates = new Float64Array(last.length);
    this.free.forEach((node, k) => {
      state.positions.set(made.positions.subarray(3 * k, 3 * k + 3), 3 * node);
      velocities.set(made.velocities.subarray(3 * k, 3 * k + 3), 3 * node);
    });
    kinematic.forEach((node, k) => {
      for (let d = 0; d < 3; d++) {
        rates[3 * k + d] = (state.positions[3 * node + d] - last[3 * k + d]) / dt;
        velocities[3 * node + d] = rates[3 * k + d];
      }
    });
    return { ...state, velocities, kinematicVelocities: rates, kinematicRates: rates.slice(), lastDt: dt };
  }

  /** Learned bones drawn to where the ropes are, the faster the farther those have taken over. */
  #following(made, ropes, share, dt) {
    const now = this.#freeOf(ropes.positions), speed = this.#freeOf(ropes.velocities), back = made.state.elapsed;
    const drawn = share === 1 ? 1 : 1 - Math.exp((-share * dt) / SECONDS_TO_FOLLOW);
    const positions = [back + this.learned.seconds, back].map((earlier, which) => {
      return made.state.positions[which].map((value, n) => (1 - drawn) * value + drawn * (now[n] - speed[n] * earlier));
    });
    return { ...made.state, positions };
  }

  #displaced(positions, frames) {
    return Float32Array.from(intoJoint(frames, this.chains.key, positions), (value, n) => value - this.rest[n]);
  }

  #corrected(ropes, frames) {
    const moved = this.#displaced(ropes.positions, frames), change = this.correction.run(moved);
    return moved.map((value, n) => value + change[n]);
  }
}

/** The state of learned bones moved rigidly, past and all, to where the key joint now is. */
function carriedAlong(state, frames, key) {
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
