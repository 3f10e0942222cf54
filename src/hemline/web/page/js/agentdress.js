// A close-fitting garment as a blend of settled states; animators/agentdress/model.

import { EdgeLimits } from "hemline/edge_limits.js";
import { intoColumns } from "hemline/kernels.js";
import { at, multiply, normalised } from "hemline/quaternions.js";

const LEAST_RELEVANCE = 1e-3, SQUARES = 0.5, LANES = 16, RAD = Math.PI / 180;
const HANGING = 30 * RAD, RAISED = 75 * RAD, ARMS = [[16, 1], [17, -1]];

export class AgentDress {
  constructor(arrays, metadata, kernels) {
    Object.assign(this, { kernels, metadata, tables: arrays });
    [this.regionCount, this.poseCount] = arrays.pose_weights.shape;
    this.count = arrays.rest.length / 3;
    this.bones = kernels.bytesOf(arrays.indices);
    this.weights = kernels.floatsOf(arrays.weights);
    this.regions = kernels.floatsOf(arrays.regions);
    this.offset = kernels.floatsOf(arrays.offset);
    this.rest = kernels.floats(3 * this.count);
    this.#unpack(arrays["basis.digits"]);
    this.mixed = kernels.floats(this.regionCount * this.columns);
    this.columnWeights = kernels.floats(this.columns);
    this.transforms = kernels.floats(16 * 24);
    this.quaternions = kernels.floats(4 * 24);
    this.joints = this.#relevantJoints();
    this.known = this.#poseAxes();
    this.limits = new EdgeLimits(arrays["limits.edges"], arrays["limits.longest"], arrays["limits.free"]);
  }

  /** Returns the state at rest on a body of any shape, and computes everything that depends on the shape only. */
  start(body) {
    const { rest, rest_effects: restEffects } = this.tables;
    this.rest.set(rest);
    features(body.betas, restEffects.shape[0] / 2).forEach((feature, f) => {
      const first = f * this.rest.length;
      if (feature !== 0) for (let i = 0; i < this.rest.length; i++) this.rest[i] += feature * restEffects[first + i];
    });
    this.effects = this.#effects(body.betas);
    return { distances: null };
  }

  /** Returns the effect of a shape (shape regions, poses, modes); animators/agentdress/shape_samples. */
  #effects(betas) {
    const poses = this.tables["shapes.poses"], betasOf = this.tables["shapes.betas"], bodies = this.tables["shapes.bodies"];
    const sizes = this.tables["shapes.sizes"], steps = this.tables["shapes.steps"]; // of weights of 8 bits, if they are
    const weights = this.tables["shapes.weights"], [regions, samples, modes] = weights.shape;
    const known = betasOf.shape[1], scale = this.tables["shapes.scale"], [reach] = this.tables["shapes.reach"];
    const query = scaleBetas(features(betas, known).slice(0, known), scale);
    this.shapePoses = poses[samples - 1] + 1;
    const out = new Float32Array(regions * this.shapePoses * modes);
    for (let i = 0; i < samples; i++) {
      const first = bodies[i] * known;
      const factor = shapeKernel(scaleBetas(betasOf.subarray(first, first + known), scale), query, reach);
      for (let g = 0; g < regions; g++) {
        const from = (g * samples + i) * modes, to = (g * this.shapePoses + poses[i]) * modes;
        const unit = sizes ? factor * sizes[g * samples + i] : factor;
        for (let k = 0; k < modes; k++) out[to + k] += unit * weights[from + k];
      }
    }
    if (steps) {
      for (let to = 0; to < out.length; to++) {
        const region = Math.floor(to / (this.shapePoses * modes));
        out[to] *= steps[region * modes + (to % modes)];
      }
    }
    return out;
  }

  /** Returns the state on a body of another shape. */
  reshape(state, body) {
    return { ...this.start(body), ...state };
  }

  /** Returns the state `dt` later [s]: axes that follow the pose. */
  advance(state, body, dt) {
    const { decay_seconds: decay, lift_deg: lift } = this.metadata, axes = this.#axes(liftArms(body.rotations, lift * RAD));
    if (state.axes && decay > 0) {
      const remaining = Math.fround(Math.exp(-dt / decay));
      axes.forEach((value, i) => (axes[i] = remaining * state.axes[i] + (1 - remaining) * value));
    }
    this.distances = this.#distances(axes);
    return { axes };
  }

  /** Writes the vertices of the last `advance` into the memory of the kernels. */
  show(body, vertices) {
    const { kernels, bones, weights, regions, digits, mixed, rest, offset, transforms, quaternions, columnWeights } = this;
    this.#mix();
    intoColumns(body.transforms, transforms);
    for (let joint = 0; joint < 24; joint++) quaternions.set(quaternionOf(body.transforms, 12 * joint), 4 * joint);
    kernels.wear(
      bones.byteOffset, weights.byteOffset, regions.byteOffset, this.regionCount, digits.byteOffset, this.columns,
      mixed.byteOffset, rest.byteOffset, offset.byteOffset, transforms.byteOffset, quaternions.byteOffset,
      columnWeights.byteOffset, this.count, vertices.byteOffset,
    );
  }

  /** Unpacks differences along vertices (columns, 3, verts) to digits (verts, 3, columns), padded by zeros. */
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

  /** Returns the joints whose rotation matters in some region. */
  #relevantJoints() {
    const { axes } = this.tables, width = 72;
    return Array.from({ length: 24 }, (_, joint) => joint).filter((joint) => {
      for (let g = 0; g < this.regionCount; g++) {
        const row = axes.subarray(g * width, (g + 1) * width), most = Math.max(...row, 1e-20);
        if (row.subarray(3 * joint, 3 * joint + 3).some((each) => each / most > LEAST_RELEVANCE)) return true;
      }
      return false;
    });
  }

  /** Returns the axes of relevant joints in the poses of the model (poses, joints, 9). */
  #poseAxes() {
    const { rotations } = this.tables, { joints, poseCount } = this;
    const out = new Float32Array(9 * poseCount * joints.length);
    for (let s = 0, to = 0; s < poseCount; s++) {
      for (const joint of joints) {
        out.set(rotationColumns(rotations.subarray(96 * s + 4 * joint, 96 * s + 4 * joint + 4)), to);
        to += 9;
      }
    }
    return out;
  }

  /** Returns the axes of relevant joints in a pose (joints, 9), without its heading. */
  #axes(rotations) {
    const out = new Float32Array(9 * this.joints.length);
    this.joints.forEach((joint, k) => {
      const own = at(rotations, joint);
      out.set(rotationColumns(joint === 0 ? removeHeading(own) : own), 9 * k);
    });
    return out;
  }

  /** Returns squared distances (regions, poses) from axes of frames to those of the model's poses (Eq. 7). */
  #distances(followed) {
    const { axes } = this.tables, { poseCount, joints, known, regionCount } = this, squares = [0, 0, 0];
    const out = new Float32Array(regionCount * poseCount);
    joints.forEach((joint, k) => {
      const here = followed.subarray(9 * k, 9 * k + 9);
      for (let s = 0; s < poseCount; s++) {
        for (let c = 0, from = 9 * (s * joints.length + k); c < 3; c++, from += 3) {
          const x = known[from] - here[3 * c], y = known[from + 1] - here[3 * c + 1], z = known[from + 2] - here[3 * c + 2];
          squares[c] = x * x + y * y + z * z;
        }
        for (let region = 0, q = 3 * joint; region < regionCount; region++, q += 72) {
          out[region * poseCount + s] += axes[q] * squares[0] + axes[q + 1] * squares[1] + axes[q + 2] * squares[2];
        }
      }
    });
    return out;
  }

  /** Computes the coefficients of each region for pose and shape, by columns of the basis [m]. */
  #mix() {
    const { tables, metadata, distances, effects, poseCount, regionCount } = this;
    const weights = tables.pose_weights, modes = tables["basis.modes"], scales = tables["basis.scales"];
    const poseModes = weights.shape[2], [shapeRegions, , shapeModes] = tables["shapes.weights"].shape;
    const anchors = this.shapePoses;
    const coefficients = new Float64Array(poseModes + shapeModes);
    for (let g = 0; g < regionCount; g++) {
      const row = Float64Array.from(distances.subarray(g * poseCount, (g + 1) * poseCount));
      coefficients.fill(0);
      for (let s = 0; s < poseCount; s++) {
        const factor = 1 / (1 + row[s] / metadata.width ** 2), first = (g * poseCount + s) * poseModes;
        for (let k = 0; k < poseModes; k++) coefficients[k] += factor * weights[first + k];
      }
      const anchorWeights = this.#anchorWeights(row.subarray(0, anchors)), region = Math.min(g, shapeRegions - 1);
      for (let s = 0; s < anchors; s++) {
        const first = (region * anchors + s) * shapeModes;
        if (anchorWeights[s] === 0) continue;
        for (let k = 0; k < shapeModes; k++) coefficients[poseModes + k] += anchorWeights[s] * effects[first + k];
      }
      for (let k = 0; k < modes.length; k++) this.mixed[g * this.columns + k] = coefficients[modes[k]] * scales[k];
    }
  }

  /** Returns the weight of each anchor in the effect of the shape: a kernel, or a blend of the nearest ones (Eq. 8). */
  #anchorWeights(distances) {
    const { shape_model: model, shape_width: width, neighbours, power, floor } = this.metadata;
    if (model === "kernel") return distances.map((each) => 1 / (1 + each / width ** 2));
    const sorted = distances.slice().sort(), farthest = sorted[Math.min(neighbours, sorted.length) - 1];
    const weights = distances.map((each) => (each <= farthest ? ((sorted[0] + floor) / (each + floor)) ** power : 0));
    const sum = weights.reduce((one, other) => one + other, 0);
    return weights.map((each) => each / sum);
  }
}

/** The kernel over shapes; animators/agentdress/shape_samples. */
function shapeKernel(one, other, reach) {
  const sum = (value) => one.reduce((total, _, i) => total + value(one[i], other[i]), 0);
  if (reach === 0) return sum((a, b) => a * b + SQUARES * SQUARES * a * a * b * b);
  const area = reach * reach, k = (square) => 1 / (1 + square / area);
  return area * (k(sum((a, b) => (a - b) ** 2)) - k(sum((a) => a * a)) * k(sum((_, b) => b * b)));
}

/** Multiplies betas by a symmetric matrix, for distances between shapes; animators/agentdress/shape_distance. */
function scaleBetas(betas, scale) {
  const count = betas.length;
  return Float64Array.from(betas, (_, j) => betas.reduce((sum, beta, i) => sum + beta * scale[i * count + j], 0));
}

/** Returns (beta, beta^2) for a number of betas; missing ones are zero. */
function features(betas, count) {
  const known = Array.from({ length: count }, (_, i) => betas[i] ?? 0);
  return [...known, ...known.map((beta) => beta * beta)].map(Math.fround);
}

/** Returns rotations with hanging upper arms lifted off the torso by `lift` [rad]; bodies/lifted_arms. */
function liftArms(rotations, lift) {
  const out = Float64Array.from(rotations);
  for (const [joint, side] of ARMS) {
    const [w, x, y, z] = at(rotations, joint);
    const hanging = Math.acos(Math.min(1, Math.max(-1, -2 * side * (x * y + w * z))));
    const fraction = Math.min(1, Math.max(0, (hanging - HANGING) / (RAISED - HANGING)));
    const half = 0.5 * lift * (1 - fraction * fraction * (3 - 2 * fraction)), c = Math.cos(half), s = side * Math.sin(half);
    out.set([c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w], 4 * joint);
  }
  return out;
}

/** Returns the columns of the matrix of a unit quaternion, one after another. */
function rotationColumns([w, x, y, z]) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
    2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
    2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y),
  ];
}

/** Removes the rotation about the vertical. */
function removeHeading([w, x, y, z]) {
  const length = Math.sqrt(w * w + y * y);
  return length < 1e-9 ? [w, x, y, z] : multiply([w / length, 0, -y / length, 0], [w, x, y, z]);
}

/** Returns the quaternion of a transform; bodies/dual_quaternion_kernels. */
function quaternionOf(m, f) {
  const xx = m[f], yy = m[f + 5], zz = m[f + 10];
  const squares = [1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz];
  const a = m[f + 9] - m[f + 6], b = m[f + 2] - m[f + 8], c = m[f + 4] - m[f + 1];
  const d = m[f + 1] + m[f + 4], e = m[f + 2] + m[f + 8], g = m[f + 6] + m[f + 9];
  const rows = [[squares[0], a, b, c], [a, squares[1], d, e], [b, d, squares[2], g], [c, e, g, squares[3]]];
  return normalised(rows[squares.indexOf(Math.max(...squares))]);
}
