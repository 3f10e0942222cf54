// Simulation of rope chains; animators/ropes/rope_step_kernels, kick_kernels, dynamics and chains.

import { PlacedCones } from "hemline/cones.js";
import { Contact } from "hemline/contact.js";
import { externalAccelerations, springAccelerations } from "hemline/forces.js";
import { framesBetween } from "hemline/joint_frames.js";
import { impulseDemand, pull, readChain, solveDirect, solveSweeps, tensionDemand } from "hemline/tensions.js";
import { moveNode } from "hemline/turns.js";

const SPEED_LIMIT = 200, LONGEST_FRAME = 1 / 24, TELEPORT_SPEED = 30;
const MOMENT = 0.004, MOMENT_DISTANCE = 0.001;

export class Chains {
  /** `arrays` and `constants` are those that `web/ropes_part.py` writes. */
  constructor(arrays, constants, key) {
    Object.assign(this, {
      constants, key, offsets: arrays.offsets, lengths: arrays.lengths, restSpans: arrays.rest_spans,
      restDirections: arrays.rest_directions, inverse: arrays.inverse_masses, margins: arrays.margins,
      joints: arrays.chain_joints, across: arrays.across, pairs: arrays.pairs, pairSpans: arrays.pair_spans,
      balance: arrays.balance, restLoads: arrays.rest_loads, restTensions: arrays.rest_tensions,
      kinematic: arrays.kinematic, carriageWeights: arrays.carriage_weights, carriageRest: arrays.carriage_rest,
      parents: arrays.parents, rest: arrays.rest, pivots: arrays.pivots, gentle: arrays.gentle_substep[0],
    });
    this.count = this.lengths.length;
    this.cones = { joints: arrays.cone_joints, shapes: arrays.cone_shapes };
    const numbers = (width = 1) => new Float64Array(width * this.count), flags = () => new Uint8Array(this.count);
    this.work = {
      springs: numbers(3), accelerations: numbers(3), starts: numbers(3), ends: numbers(3), directions: numbers(3),
      spans: numbers(), slack: numbers(), diagonal: numbers(), beside: numbers(), wanted: numbers(), upper: numbers(),
      impulses: numbers(), taut: flags(), pulling: flags(), active: flags(), free: flags(),
      chainFrames: new Float64Array(9 * this.joints.length), rootVelocities: new Float64Array(3 * this.joints.length),
    };
  }

  /** Returns the state at rest on a body with the skin transforms `frames`. */
  start(frames) {
    const f = 12 * this.key, positions = new Float64Array(this.rest.length);
    for (let n = 0; n < positions.length; n += 3) {
      for (let a = 0; a < 3; a++) {
        const row = f + 4 * a;
        positions[n + a] = this.rest[n] * frames[row] + this.rest[n + 1] * frames[row + 1]
          + this.rest[n + 2] * frames[row + 2] + frames[row + 3];
      }
    }
    this.#setKinematic(this.kinematicPositions(frames), positions);
    const still = new Float64Array(3 * this.kinematic.length);
    return {
      positions, velocities: new Float64Array(positions.length), tensions: this.restTensions.slice(), frames,
      kinematicVelocities: still, kinematicRates: still.slice(), lastDt: 0,
    };
  }

  /** Returns the positions of the kinematic bones on a body. */
  kinematicPositions(frames) {
    const { carriageWeights: weights, carriageRest: rest } = this, out = new Float64Array(rest.length);
    for (let k = 0; 3 * k < rest.length; k++) {
      for (let a = 0; a < 3; a++) {
        let value = 0;
        for (let j = 0; j < 24; j++) {
          const weight = weights[24 * k + j], row = 12 * j + 4 * a;
          if (weight !== 0) {
            value += weight * (frames[row] * rest[3 * k] + frames[row + 1] * rest[3 * k + 1]
              + frames[row + 2] * rest[3 * k + 2] + frames[row + 3]);
          }
        }
        out[3 * k + a] = value;
      }
    }
    return out;
  }

  /** Returns the state `dt` later [s] on a posed body; the previous state is not changed. */
  step(before, frames, dt) {
    if (this.isMoment(before, frames, dt)) return this.#carryAlong(before, frames);
    const state = this.teleported(before.frames, frames, dt) ? this.#followTeleport(before, frames) : before;
    const motion = this.#kinematicMotion(state, frames, dt), { kinematic } = this;
    const positions = state.positions.slice(), velocities = state.velocities.slice(), tensions = state.tensions.slice();
    if (state.lastDt === 0) this.#moveAlong(motion.startRates, velocities);
    this.#advance(state.frames, frames, motion, dt, positions, velocities, tensions);
    const kinematicRates = motion.ends.map((end, i) => (end - motion.starts[i]) / dt);
    this.#setKinematic(motion.ends, positions);
    for (let k = 0; k < kinematic.length; k++) {
      for (let d = 0; d < 3; d++) velocities[3 * kinematic[k] + d] = motion.endRates[3 * k + d];
    }
    return {
      positions, velocities, tensions, frames, kinematicVelocities: motion.endRates, kinematicRates, lastDt: dt,
    };
  }

  /** Whether the key joint moved farther between two poses than a body can. */
  teleported(from, to, dt) {
    let total = 0;
    for (let a = 0; a < 3; a++) {
      const row = 12 * this.key + 4 * a;
      let distance = to[row + 3] - from[row + 3];
      for (let b = 0; b < 3; b++) distance += (to[row + b] - from[row + b]) * this.pivots[3 * this.key + b];
      total += distance * distance;
    }
    return Math.sqrt(total) > Math.max(this.constants.teleport, TELEPORT_SPEED * dt);
  }

  /** Whether a step is too short for the way of the body in it [s], which then says nothing about its speed. */
  isMoment(state, frames, dt) {
    if (dt >= MOMENT) return false;
    const ends = this.kinematicPositions(frames), least = Math.max(MOMENT_DISTANCE, TELEPORT_SPEED * dt);
    return this.kinematic.some((node, k) => Math.hypot(
      ...[0, 1, 2].map((d) => ends[3 * k + d] - state.positions[3 * node + d]),
    ) > least);
  }

  /** Returns the state moved rigidly with the key joint, with velocities and history as they were. */
  #carryAlong(state, frames) {
    const move = rigidBetween(state.frames, frames, this.key), positions = move.points(state.positions);
    this.#setKinematic(this.kinematicPositions(frames), positions);
    const [velocities, kinematicVelocities, kinematicRates] = [
      state.velocities, state.kinematicVelocities, state.kinematicRates,
    ].map((each) => move.vectors(each));
    return { ...state, positions, velocities, kinematicVelocities, kinematicRates, frames };
  }

  /** Returns the state moved rigidly with the key joint, with relative velocities and without history. */
  #followTeleport(state, frames) {
    const move = rigidBetween(state.frames, frames, this.key), positions = move.points(state.positions);
    this.#setKinematic(this.kinematicPositions(frames), positions);
    const mean = [0, 1, 2].map((d) => meanOf(state.kinematicVelocities, d));
    const velocities = move.vectors(state.velocities.map((value, n) => value - mean[n % 3]));
    return { ...state, positions, velocities, frames, lastDt: 0 };
  }

  /** Adds the mean velocity of the roots, for a state without history. */
  #moveAlong(rates, velocities) {
    const first = 3 * this.offsets[0];
    const mean = [0, 1, 2].map((d) => meanOf(rates.subarray(first), d));
    for (let n = 0; n < velocities.length; n++) velocities[n] += mean[n % 3];
  }

  /** Returns positions and velocities of the kinematic bones at both ends of a step. */
  #kinematicMotion(state, frames, dt) {
    const ends = this.kinematicPositions(frames), length = ends.length, { lastDt } = state;
    const starts = new Float64Array(length), startRates = new Float64Array(length), endRates = new Float64Array(length);
    for (let n = 0; n < length; n++) {
      starts[n] = state.positions[3 * this.kinematic[Math.floor(n / 3)] + (n % 3)];
      const rate = (ends[n] - starts[n]) / dt;
      startRates[n] = lastDt > 0 ? state.kinematicVelocities[n] : rate;
      endRates[n] = lastDt > 0 ? rate + ((rate - state.kinematicRates[n]) * dt) / (dt + lastDt) : rate;
    }
    return { starts, ends, startRates, endRates };
  }

  #substeps(motion, dt) {
    let change = 0;
    for (let d = 0; d < 3 && motion.ends.length; d++) {
      change += ((meanOf(motion.endRates, d) - meanOf(motion.startRates, d)) / dt) ** 2;
    }
    const limit = Math.ceil(this.constants.substep_limit * Math.max(1, dt / LONGEST_FRAME));
    const gentle = this.gentle / Math.sqrt(Math.max(Math.sqrt(change) + Math.hypot(...this.constants.gravity), 1e-6));
    return Math.max(1, Math.min(limit, Math.ceil(dt / Math.min(this.constants.substep, gentle) - 1e-9)));
  }

  /** Section 3, steps 1 to 4, in substeps; positions, velocities and tensions are changed. */
  #advance(from, to, motion, dt, positions, velocities, tensions) {
    const { offsets, lengths, inverse, margins, work: w, cones } = this, chains = offsets.length - 1;
    const steps = this.#substeps(motion, dt), h = dt / steps, project = this.constants.position_update === "project";
    const before = from.slice(), after = from.slice(), placed = new PlacedCones(cones);
    const contact = new Contact(cones, placed, this.constants);
    placed.place(before, before);
    this.#placeKinematic(motion, dt, 0, positions, velocities);
    this.#turnChains(before);
    for (let c = 0; c < chains; c++) readChain(w, offsets[c], offsets[c + 1], lengths, inverse, positions);
    springAccelerations(this, w, h, tensions, positions);
    for (let step = 0; step < steps; step++) {
      const fraction = (step + 1) / steps;
      w.starts.set(positions);
      this.#placeKinematic(motion, dt, fraction, positions, w.ends);
      for (let c = 0; c < chains; c++) {
        for (let d = 0, n = 3 * offsets[c]; d < 3; d++, n++) {
          w.rootVelocities[3 * c + d] = (positions[n] - w.starts[n]) / h;
        }
      }
      externalAccelerations(this, w, h, w.starts, velocities);
      this.#kick(h, false, velocities, tensions);
      framesBetween(from, to, this.pivots, fraction, after);
      placed.place(before, after);
      for (let c = 0; c < chains; c++) {
        const a = offsets[c], b = offsets[c + 1];
        for (let i = a + 1; i < b; i++) moveNode(i, lengths[i], w.pulling[i], project, h, w.starts, velocities, positions);
        const hit = contact.resolve(a, b, lengths, margins, before, after, h, w.starts, positions, velocities);
        for (let d = 0; d < 3; d++) w.rootVelocities[3 * c + d] = w.ends[3 * a + d];
        readChain(w, a, b, lengths, inverse, positions);
        if (hit) {
          w.free.fill(0, a, b);
          this.#applyImpulses(a, b, h, velocities);
        }
      }
      this.#turnChains(after);
      springAccelerations(this, w, h, tensions, positions);
      externalAccelerations(this, w, h, positions, velocities);
      this.#kick(h, true, velocities, tensions);
      before.set(after);
    }
  }

  /** Half a kick by external forces and tensions, then impulses (Eq. 2 to 9). */
  #kick(h, second, velocities, tensions) {
    const { offsets, inverse, work: w, constants } = this;
    for (let c = 0; c + 1 < offsets.length; c++) {
      const a = offsets[c], b = offsets[c + 1];
      for (let d = 0; d < 3; d++) {
        w.accelerations[3 * a + d] = ((w.rootVelocities[3 * c + d] - velocities[3 * a + d]) * 2) / h;
      }
      w.free.fill(0, a, b);
      // tensions change the rotation half a step later: solve first without, then with that change
      for (let attempt = 0; attempt < 2; attempt++) {
        tensionDemand(w, a, b, inverse, tensions, velocities, h, 0.5 * h * attempt, w.wanted);
        const sweeps = constants.tension_sweeps;
        if (sweeps > 0) solveSweeps(w, a, b, w.wanted, w.free, sweeps, true, tensions);
        else solveDirect(w, a, b, w.wanted, w.free, tensions);
      }
      for (let i = a; i < b; i++) {
        w.pulling[i] = i > a && tensions[i] > 0 ? 1 : 0;
        w.free[i] = second && w.pulling[i] ? 1 : 0;
        for (let n = 3 * i; n < 3 * i + 3; n++) velocities[n] += 0.5 * h * w.accelerations[n];
      }
      pull(w, a, b, inverse, tensions, 0.5 * h, velocities);
      this.#applyImpulses(a, b, h, velocities);
    }
    this.#limitSpeeds(velocities);
  }

  #applyImpulses(a, b, h, velocities) {
    const { work: w, inverse } = this, sweeps = this.constants.impulse_sweeps;
    impulseDemand(w, a, b, velocities, h, w.wanted);
    w.impulses.fill(0, a, b);
    if (sweeps > 0) solveSweeps(w, a, b, w.wanted, w.free, sweeps, false, w.impulses);
    else solveDirect(w, a, b, w.wanted, w.free, w.impulses);
    pull(w, a, b, inverse, w.impulses, 1, velocities);
  }

  #limitSpeeds(velocities) {
    const { offsets } = this;
    for (let c = 0; c + 1 < offsets.length; c++) {
      const r = 3 * offsets[c];
      for (let n = r + 3; n < 3 * offsets[c + 1]; n += 3) {
        const x = velocities[n] - velocities[r], y = velocities[n + 1] - velocities[r + 1];
        const z = velocities[n + 2] - velocities[r + 2], speed = Math.sqrt(x * x + y * y + z * z);
        if (speed <= SPEED_LIMIT) continue;
        const fraction = SPEED_LIMIT / speed;
        velocities[n] = velocities[r] + fraction * x;
        velocities[n + 1] = velocities[r + 1] + fraction * y;
        velocities[n + 2] = velocities[r + 2] + fraction * z;
      }
    }
  }

  /** Places the kinematic bones at a fraction of the step (cubic Hermite). */
  #placeKinematic({ starts, ends, startRates, endRates }, dt, s, positions, velocities) {
    const a = 1 - s * s * (3 - 2 * s), b = s * s * (3 - 2 * s);
    const c = s * (1 - s) * (1 - s) * dt, d = s * s * (s - 1) * dt;
    const e = (6 * s * (1 - s)) / dt, f = (1 - s) * (1 - 3 * s), g = s * (3 * s - 2);
    for (let k = 0; k < this.kinematic.length; k++) {
      for (let x = 0, n = 3 * k, i = 3 * this.kinematic[k]; x < 3; x++, n++, i++) {
        positions[i] = s >= 1 ? ends[n] : a * starts[n] + b * ends[n] + c * startRates[n] + d * endRates[n];
        velocities[i] = e * (ends[n] - starts[n]) + f * startRates[n] + g * endRates[n];
      }
    }
  }

  #turnChains(frames) {
    this.joints.forEach((joint, c) => {
      for (let a = 0; a < 3; a++) {
        for (let b = 0; b < 3; b++) this.work.chainFrames[9 * c + 3 * a + b] = frames[12 * joint + 4 * a + b];
      }
    });
  }

  /** Copies positions of the kinematic bones into those of all bones. */
  #setKinematic(kinematicPositions, positions) {
    this.kinematic.forEach((node, k) => positions.set(kinematicPositions.subarray(3 * k, 3 * k + 3), 3 * node));
  }
}

/** Returns the rigid motion of a joint from some frames to others. */
export function rigidBetween(from, to, joint) {
  const f = 12 * joint, turn = new Float64Array(9);
  for (let a = 0; a < 3; a++) {
    for (let b = 0; b < 3; b++) {
      for (let c = 0; c < 3; c++) turn[3 * a + b] += to[f + 4 * a + c] * from[f + 4 * b + c];
    }
  }
  const moved = (values, away, added) => values.map((_, n) => {
    const first = n - (n % 3), row = 3 * (n % 3);
    let value = added[n % 3];
    for (let c = 0; c < 3; c++) value += turn[row + c] * (values[first + c] - away[c]);
    return value;
  });
  const shift = (frames) => [frames[f + 3], frames[f + 7], frames[f + 11]], none = [0, 0, 0];
  return {
    turn, points: (points) => moved(points, shift(from), shift(to)), vectors: (vectors) => moved(vectors, none, none),
  };
}

function meanOf(values, d) {
  let sum = 0;
  for (let n = d; n < values.length; n += 3) sum += values[n];
  return (3 * sum) / values.length;
}
