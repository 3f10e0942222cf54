// Learned bones: a network in a closed loop; animators/ropes/bones/learned_bones, bone_contact_kernels.

import { bodyInputs, COUNT, jointsOn } from "hemline/body_inputs.js";
import { distance, closest } from "hemline/cones.js";
import { intoJoint, point, toRest, toWorld, rotateToWorld } from "hemline/joint_frames.js";
import { Mlp } from "hemline/networks.js";

const MAX_STEPS = 16, TOLERANCE = 1e-6, LEAST_RANGE = 0.02, ROUNDS = 4;

export class LearnedBones {
  constructor(arrays, { seconds, clearance }, chains, kernels) {
    this.network = new Mlp(arrays, kernels);
    Object.assign(this, { seconds, clearance, chains, low: arrays.low, high: arrays.high });
    [this.modeCount, this.rows] = arrays.modes.shape;
    this.modes = Float64Array.from(arrays.modes);
    this.margins = arrays.margins;
    this.free = arrays.free;
    this.rest = Float64Array.from(Array.from(this.free).flatMap((node) => [...arrays.rest.subarray(3 * node, 3 * node + 3)]));
  }

  start(positions, frames) {
    return { positions: [positions, positions], bodies: [frames, frames, frames], elapsed: 0 };
  }

  /** Returns state, bones and their velocities `dt` later, and the largest excess over the range of the training. */
  step(state, frames, seconds) {
    const h = this.seconds, dt = Math.min(seconds, MAX_STEPS * h);
    let { positions, bodies, elapsed } = state, beyond = 0, elapsedTime = 0;
    while (elapsed + dt - elapsedTime >= h * (1 - TOLERANCE)) {
      elapsedTime += h - elapsed;
      elapsed = 0;
      const now = elapsedTime >= dt - TOLERANCE * h ? frames : this.#between(bodies[2], frames, elapsedTime / dt);
      const result = this.#predict(positions, bodies, now, h);
      positions = [positions[1], result.bones], beyond = Math.max(beyond, result.out);
      bodies = [bodies[1], now, bodies[2]];
    }
    elapsed += Math.max(dt - elapsedTime, 0);
    bodies = [bodies[0], bodies[1], frames];
    if (elapsed < TOLERANCE * h) {
      const velocities = positions[1].map((value, n) => (value - positions[0][n]) / h);
      return { state: { positions, bodies, elapsed: 0 }, positions: positions[1], velocities, beyond };
    }
    const result = this.#predict(positions, bodies, frames, elapsed);
    const velocities = result.bones.map((value, n) => (value - positions[1][n]) / elapsed);
    const after = { positions, bodies, elapsed };
    return { state: after, positions: result.bones, velocities, beyond: Math.max(beyond, result.out) };
  }

  /** Returns the bones `dt` after the last full step, and the largest excess over the range of the training. */
  #predict(positions, bodies, now, dt) {
    const fraction = dt / this.seconds, { modes, modeCount, rows, rest, low, high } = this, key = this.chains.key;
    const features = new Float64Array(low.length), f = 12 * key;
    bodyInputs(bodies[0], bodies[1], now, this.seconds, dt, this.chains, features);
    const local = intoJoint(now, key, positions[1]).map((value, n) => value - rest[n]);
    const earlier = intoJoint(now, key, positions[0]).map((value, n) => value - rest[n]);
    for (let k = 0; k < modeCount; k++) {
      let place = 0, change = 0;
      for (let n = 0, m = k * rows; n < rows; n++, m++) {
        place += modes[m] * local[n];
        change += modes[m] * (local[n] - earlier[n]);
      }
      features[COUNT + k] = place, features[COUNT + modeCount + k] = change;
    }
    let out = 0;
    const clamped = features.map((value, i) => {
      const inside = Math.min(Math.max(value, low[i]), high[i]);
      out = Math.max(out, Math.abs(value - inside) / Math.max(Math.fround(high[i] - low[i]), LEAST_RANGE));
      return inside;
    });
    const answer = this.network.run(clamped), bones = new Float64Array(rows), moved = rest.slice();
    for (let k = 0; k < modeCount; k++) {
      const i = COUNT + k, predicted = features[i] + fraction * features[i + modeCount] + fraction ** 2 * answer[k];
      const coefficient = Math.min(Math.max(predicted, low[i]), high[i]);
      out = Math.max(out, Math.abs(predicted - coefficient) / Math.max(Math.fround(high[i] - low[i]), LEAST_RANGE));
      for (let n = 0, m = k * rows; n < rows; n++, m++) moved[n] += coefficient * modes[m];
    }
    for (let n = 0; n < rows; n += 3) {
      for (let a = 0; a < 3; a++) {
        const row = f + 4 * a;
        bones[n + a] = moved[n] * now[row] + moved[n + 1] * now[row + 1] + moved[n + 2] * now[row + 2] + now[row + 3];
      }
    }
    this.#pushOut(now, bones);
    return { bones, out };
  }

  /** Pushes each bone out of its deepest cone, to its own distance. */
  #pushOut(frames, bones) {
    const { joints, shapes } = this.chains.cones, { margins } = this, balls = this.#balls(frames);
    for (let i = 0; i < margins.length; i++) {
      const n = 3 * i;
      for (let round = 0; round < ROUNDS; round++) {
        let depth = 0, nx = 0, ny = 0, nz = 0;
        for (let k = 0; k < joints.length; k++) {
          const a = bones[n] - balls[4 * k], b = bones[n + 1] - balls[4 * k + 1], c = bones[n + 2] - balls[4 * k + 2];
          if (a * a + b * b + c * c >= balls[4 * k + 3]) continue;
          toRest(frames, joints[k], bones[n], bones[n + 1], bones[n + 2]);
          distance(shapes, k, point[0], point[1], point[2]);
          if (margins[i] - closest[0] > depth) {
            depth = margins[i] - closest[0];
            rotateToWorld(frames, joints[k], closest[1], closest[2], closest[3]);
            nx = point[0], ny = point[1], nz = point[2];
          }
        }
        if (depth <= 0) break;
        bones[n] += depth * nx, bones[n + 1] += depth * ny, bones[n + 2] += depth * nz;
      }
    }
  }

  /** Returns balls around the cones in the world, grown by the widest margin, with squared radii. */
  #balls(frames) {
    const { joints, shapes } = this.chains.cones, widest = Math.max(...this.margins);
    const balls = new Float64Array(4 * joints.length);
    for (let k = 0; k < joints.length; k++) {
      const s = shapes.subarray(16 * k, 16 * k + 8);
      toWorld(frames, joints[k], (s[0] + s[3]) / 2, (s[1] + s[4]) / 2, (s[2] + s[5]) / 2);
      const half = Math.hypot(s[3] - s[0], s[4] - s[1], s[5] - s[2]) / 2 + Math.max(s[6], s[7], 0);
      balls.set([...point, Math.max(half + widest, 0) ** 2], 4 * k);
    }
    return balls;
  }

  /** Interpolates the body between two poses: joints on straight lines, blended rotations made orthonormal. */
  #between(one, other, fraction) {
    const { pivots } = this.chains, first = jointsOn(one, pivots), second = jointsOn(other, pivots);
    const out = new Float64Array(one.length), blended = one.map((value, i) => (1 - fraction) * value + fraction * other[i]);
    for (let j = 0; 12 * j < out.length; j++) {
      const column = (c) => [0, 1, 2].map((row) => blended[12 * j + 4 * row + c]);
      const x = unit(column(0)), raw = column(1), along = raw[0] * x[0] + raw[1] * x[1] + raw[2] * x[2];
      const y = unit(raw.map((value, i) => value - along * x[i]));
      const z = [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
      for (let row = 0; row < 3; row++) {
        const place = (1 - fraction) * first[3 * j + row] + fraction * second[3 * j + row];
        const turn = [x[row], y[row], z[row]];
        const shift = turn.reduce((sum, value, c) => sum + value * pivots[3 * j + c], 0);
        out.set([...turn, place - shift], 12 * j + 4 * row);
      }
    }
    return out;
  }
}

const unit = (vector) => vector.map((value) => value / Math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2));
