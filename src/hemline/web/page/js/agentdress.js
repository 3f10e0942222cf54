// A close-fitting garment: settled states, blended; animators/agentdress/model.

import { intoColumns } from "hemline/kernels.js";
import { at, multiply, normalised } from "hemline/quaternions.js";

const LEAST_INFLUENCE = 1e-3, LANES = 16, RAD = Math.PI / 180;
const LIFT = 20 * RAD, HANGING = 30 * RAD, RAISED = 75 * RAD, ARMS = [[16, 1], [17, -1]];
const DEEPEST = 0.03, ASIDE = 0.03; // as in animators/agentdress/model [m]

export class AgentDress {
  constructor(arrays, metadata, kernels) {
    Object.assign(this, { kernels, metadata, tables: arrays });
    [this.regionCount, this.poseCount] = arrays.pose_weights.shape;
    this.count = arrays.rest.length / 3;
    this.bones = kernels.bytesOf(arrays.indices);
    this.weights = kernels.floatsOf(arrays.weights);
    this.regions = kernels.floatsOf(arrays.regions);
    this.offset = kernels.floatsOf(arrays.offset);
    this.clearances = kernels.floatsOf(arrays.clearances);
    this.kept = arrays.clearances.some((clearance) => clearance > -1);
    this.skin = kernels.floats(3 * this.count);
    this.normals = kernels.floats(3 * this.count);
    this.rest = kernels.floats(3 * this.count);
    this.#unpack(arrays["basis.digits"]);
    this.mixed = kernels.floats(this.regionCount * this.columns);
    this.shares = kernels.floats(this.columns);
    this.transforms = kernels.floats(16 * 24);
    this.quaternions = kernels.floats(4 * 24);
    this.joints = this.#countingJoints();
  }

  /** At rest on a body of any shape: what depends on the shape alone is made anew. */
  start(body) {
    const { rest, rest_effects: restEffects, shape_effects: effects } = this.tables;
    const wide = restEffects.shape[0] / 2, narrow = effects.shape[0] / 2, size = effects.length / effects.shape[0];
    this.rest.set(rest);
    features(body.betas, wide).forEach((feature, f) => {
      const first = f * this.rest.length;
      if (feature !== 0) for (let i = 0; i < this.rest.length; i++) this.rest[i] += feature * restEffects[first + i];
    });
    this.effects = new Float32Array(size);
    features(body.betas, narrow).forEach((feature, f) => {
      if (feature !== 0) for (let i = 0; i < size; i++) this.effects[i] += feature * effects[f * size + i];
    });
    this.#under(body.restNormals, this.normals);
    return { distances: null };
  }

  /** The state on a body of another shape. */
  reshaped(state, body) {
    return { ...this.start(body), ...state };
  }

  /** The state `dt` later [s]: distances that follow the pose. */
  advance(state, body, dt) {
    const distances = this.#distances(lifted(body.rotations)), { decay_seconds: decay } = this.metadata;
    if (state.distances && decay > 0) {
      const kept = Math.fround(Math.exp(-dt / decay));
      distances.forEach((value, i) => (distances[i] = kept * state.distances[i] + (1 - kept) * value));
    }
    this.distances = distances;
    return { distances };
  }

  /** The vertices of the last `advance`, into the kernels' memory. */
  show(body, vertices) {
    const { kernels, bones, weights, regions, digits, mixed, rest, offset, transforms, quaternions, shares } = this;
    this.#mix();
    intoColumns(body.transforms, transforms);
    for (let joint = 0; joint < 24; joint++) quaternions.set(quaternionOf(body.transforms, 12 * joint), 4 * joint);
    if (this.kept) this.#under(body.vertices, this.skin);
    kernels.wear(
      bones.byteOffset, weights.byteOffset, regions.byteOffset, this.regionCount, digits.byteOffset, this.columns,
      mixed.byteOffset, rest.byteOffset, offset.byteOffset, transforms.byteOffset, quaternions.byteOffset,
      shares.byteOffset, this.clearances.byteOffset, this.skin.byteOffset, this.normals.byteOffset, DEEPEST, ASIDE,
      this.count, vertices.byteOffset,
    );
  }

  /** Of the body's vertex under each of the garment's. */
  #under(values, out) {
    this.tables.nearest.forEach((vertex, i) => out.set(values.subarray(3 * vertex, 3 * vertex + 3), 3 * i));
  }

  /** Digits (columns, 3, verts), differences along the vertices, to (verts, 3, columns), padded by zeros. */
  #unpack(digits) {
    const known = digits.shape[0];
    this.columns = LANES * Math.ceil(known / LANES);
    this.digits = this.kernels.bytes(3 * this.count * this.columns);
    for (let from = 0, column = 0; column < known; column++) {
      for (let c = 0; c < 3; c++) {
        for (let v = 0, value = 0; v < this.count; v++, from++) {
          value = ((value + digits[from]) << 24) >> 24;
          this.digits[(3 * v + c) * this.columns + column] = value;
        }
      }
    }
  }

  /** Joints whose turns count in some region. */
  #countingJoints() {
    const { influence } = this.tables, width = 72;
    return Array.from({ length: 24 }, (_, joint) => joint).filter((joint) => {
      for (let g = 0; g < this.regionCount; g++) {
        const row = influence.subarray(g * width, (g + 1) * width), most = Math.max(...row, 1e-20);
        if (row.subarray(3 * joint, 3 * joint + 3).some((each) => each / most > LEAST_INFLUENCE)) return true;
      }
      return false;
    });
  }

  /** Squared distances (regions, poses) from a pose to those of the model, its heading left out (Eq. 7). */
  #distances(rotations) {
    const { influence, rotations: known } = this.tables, { poseCount } = this;
    const out = new Float32Array(this.regionCount * poseCount);
    for (const joint of this.joints) {
      const own = at(rotations, joint), [e, f, g, h] = joint === 0 ? withoutHeading(own) : own;
      for (let s = 0, r = 4 * joint; s < poseCount; s++, r += 96) {
        const a = known[r], b = -known[r + 1], c = -known[r + 2], d = -known[r + 3];
        const x = a * f + b * e + c * h - d * g, y = a * g - b * h + c * e + d * f, z = a * h + b * g - c * f + d * e;
        const cosine = Math.min(Math.abs(a * e - b * f - c * g - d * h), 1), half = Math.acos(cosine);
        // twice the half angle along the axis, squared
        const factor = cosine > 1 - 1e-12 ? 4 : (4 * half * half) / (1 - cosine * cosine);
        for (let region = 0, q = 3 * joint; region < this.regionCount; region++, q += 72) {
          out[region * poseCount + s] += factor * (influence[q] * x * x + influence[q + 1] * y * y + influence[q + 2] * z * z);
        }
      }
    }
    return out;
  }

  /** What each region makes of pose and shape, by columns of the basis [m]. */
  #mix() {
    const { tables, metadata, distances, effects, poseCount, regionCount } = this;
    const weights = tables.pose_weights, modes = tables["basis.modes"], scales = tables["basis.scales"];
    const poseModes = weights.shape[2], [, shapeRegions, anchors, shapeModes] = tables.shape_effects.shape;
    const told = new Float64Array(poseModes + shapeModes);
    for (let g = 0; g < regionCount; g++) {
      const row = Float64Array.from(distances.subarray(g * poseCount, (g + 1) * poseCount));
      told.fill(0);
      for (let s = 0; s < poseCount; s++) {
        const share = 1 / (1 + row[s] / metadata.width ** 2), first = (g * poseCount + s) * poseModes;
        for (let k = 0; k < poseModes; k++) told[k] += share * weights[first + k];
      }
      const shares = this.#anchorShares(row.subarray(0, anchors)), region = Math.min(g, shapeRegions - 1);
      for (let s = 0; s < anchors; s++) {
        const first = (region * anchors + s) * shapeModes;
        if (shares[s] === 0) continue;
        for (let k = 0; k < shapeModes; k++) told[poseModes + k] += shares[s] * effects[first + k];
      }
      for (let k = 0; k < modes.length; k++) this.mixed[g * this.columns + k] = told[modes[k]] * scales[k];
    }
  }

  /** What each anchor counts for in what the shape adds: a kernel, or the nearest ones blended (Eq. 8). */
  #anchorShares(distances) {
    const { shape_model: model, shape_width: width, neighbours, power, floor } = this.metadata;
    if (model === "kernel") return distances.map((each) => 1 / (1 + each / width ** 2));
    const sorted = distances.slice().sort(), farthest = sorted[Math.min(neighbours, sorted.length) - 1];
    const weights = distances.map((each) => (each <= farthest ? ((sorted[0] + floor) / (each + floor)) ** power : 0));
    const sum = weights.reduce((one, other) => one + other, 0);
    return weights.map((each) => each / sum);
  }
}

/** (beta, beta^2) of so many betas, zeros where there are fewer. */
function features(betas, count) {
  const known = Array.from({ length: count }, (_, i) => betas[i] ?? 0);
  return [...known, ...known.map((beta) => beta * beta)].map(Math.fround);
}

/** The rotations with upper arms that hang lifted off the torso; bodies/lifted_arms. */
function lifted(rotations) {
  const out = Float64Array.from(rotations);
  for (const [joint, side] of ARMS) {
    const [w, x, y, z] = at(rotations, joint);
    const hanging = Math.acos(Math.min(1, Math.max(-1, -2 * side * (x * y + w * z))));
    const share = Math.min(1, Math.max(0, (hanging - HANGING) / (RAISED - HANGING)));
    const half = 0.5 * LIFT * (1 - share * share * (3 - 2 * share)), c = Math.cos(half), s = side * Math.sin(half);
    out.set([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], 4 * joint);
  }
  return out;
}

/** A rotation without its turn about the vertical. */
function withoutHeading([w, x, y, z]) {
  const length = Math.sqrt(w * w + y * y);
  return length < 1e-9 ? [w, x, y, z] : multiply([w / length, 0, -y / length, 0], [w, x, y, z]);
}

/** The quaternion of a transform; bodies/dual_quaternion_kernels. */
function quaternionOf(m, f) {
  const xx = m[f], yy = m[f + 5], zz = m[f + 10];
  const squares = [1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz];
  const a = m[f + 9] - m[f + 6], b = m[f + 2] - m[f + 8], c = m[f + 4] - m[f + 1];
  const d = m[f + 1] + m[f + 4], e = m[f + 2] + m[f + 8], g = m[f + 6] + m[f + 9];
  const rows = [[squares[0], a, b, c], [a, squares[1], d, e], [b, d, squares[2], g], [c, e, g, squares[3]]];
  return normalised(rows[squares.indexOf(Math.max(...squares))]);
}
