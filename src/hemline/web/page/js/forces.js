// External accelerations of rope nodes; animators/ropes/rope_force_kernels (paper, section 4).
// `chains` has constant data, `w` the work arrays of a step.

const LATERAL_BOUND = 0.4, SHRINK_BOUND = 0.3, REST_ANGLE_BOUND = 0.1, STANDARD_GRAVITY = 9.81;

const bounded = (constant, h, bound) => constant / (1 + (constant * h * h) / bound);

/** Computes gravity, balance and springs, which do not depend on velocities, into `w.springs`. */
export function springAccelerations(chains, w, h, tensions, positions) {
  const { constants } = chains, { springs } = w, [gx, gy, gz] = constants.gravity;
  for (let n = 0; n < springs.length; n += 3) springs[n] = gx, springs[n + 1] = gy, springs[n + 2] = gz;
  addBalance(chains, w, tensions, positions);
  if (constants.lateral > 0 || constants.lateral_stretch > 0) addLateral(chains, w, h, positions);
  if (constants.shrink > 0) addShrink(chains, w, h, positions);
  if (constants.rest_angle > 0) addRestAngles(chains, w, h, positions);
}

/** Adds the air, and damping between neighbours, into `w.accelerations`. */
export function externalAccelerations(chains, w, h, positions, velocities) {
  const { offsets, constants } = chains, { springs, accelerations } = w, { drag, wind } = constants;
  for (let c = 0; c + 1 < offsets.length; c++) {
    for (let i = offsets[c] + 1; i < offsets[c + 1]; i++) {
      const damping = constants.parent_damping + constants.root_damping * Math.exp(offsets[c] + 1 - i);
      const rate = (1 - Math.exp(-0.5 * h * (drag + damping))) / (0.5 * h);
      const fraction = drag + damping > 0 ? drag / (drag + damping) : 0;
      for (let d = 0, n = 3 * i; d < 3; d++, n++) {
        const towards = fraction * wind[d] + (1 - fraction) * velocities[n - 3];
        accelerations[n] = springs[n] + rate * (towards - velocities[n]);
      }
    }
  }
  if (constants.bend_damping > 0 || constants.lateral_damping > 0) addSmoothing(chains, w, h, velocities);
  if (constants.air_drag > 0 || constants.air_lift > 0) addAir(chains, w, h, positions, velocities);
}

function addSpring(a, b, relative, inverse, out, x, y, z) {
  const fraction = inverse[a] + inverse[b];
  if (fraction <= 0) return;
  const first = (-relative * inverse[a]) / fraction, second = (relative * inverse[b]) / fraction;
  out[3 * a] += first * x, out[3 * a + 1] += first * y, out[3 * a + 2] += first * z;
  out[3 * b] += second * x, out[3 * b + 1] += second * y, out[3 * b + 2] += second * z;
}

function addBalance(chains, { springs, chainFrames }, tensions, positions) {
  const { offsets, inverse, balance, restLoads, restSpans, restDirections, constants } = chains;
  const gravity = Math.sqrt(constants.gravity.reduce((sum, each) => sum + each * each, 0));
  const reach = constants.balance_reach, rest = [0, 0, 0];
  for (let c = 0; c + 1 < offsets.length; c++) {
    const root = 3 * offsets[c];
    rest.fill(0);
    for (let i = offsets[c] + 1, f = 9 * c; i < offsets[c + 1]; i++) {
      let load = gravity / inverse[i];
      if (i + 1 < offsets[c + 1]) load += tensions[i + 1];
      const n = 3 * i;
      let fraction = Math.min(load / restLoads[i], gravity / STANDARD_GRAVITY);
      if (reach > 0) {
        for (let d = 0; d < 3; d++) rest[d] += restSpans[i] * restDirections[n + d];
        fraction *= remainingBalance(reach, chainFrames, f, positions, root, n, rest, balance);
      }
      const x = fraction * balance[n], y = fraction * balance[n + 1], z = fraction * balance[n + 2];
      for (let d = 0; d < 3; d++) {
        const row = f + 3 * d;
        springs[n + d] += chainFrames[row] * x + chainFrames[row + 1] * y + chainFrames[row + 2] * z;
      }
    }
  }
}

function remainingBalance(reach, frames, f, positions, root, n, rest, balance) {
  const x = balance[n], y = balance[n + 1], z = balance[n + 2], size = Math.sqrt(x * x + y * y + z * z);
  if (size < 1e-9) return 1;
  let away = 0;
  for (let d = 0; d < 3; d++) {
    const row = f + 3 * d;
    const atRest = positions[root + d] + frames[row] * rest[0] + frames[row + 1] * rest[1] + frames[row + 2] * rest[2];
    away += ((positions[n + d] - atRest) * (frames[row] * x + frames[row + 1] * y + frames[row + 2] * z)) / size;
  }
  return Math.min(1, Math.max(0, 1 - away / reach));
}

function addLateral({ pairs, pairSpans, inverse, constants }, { springs }, h, positions) {
  const soft = bounded(constants.lateral, h, LATERAL_BOUND);
  const stiff = bounded(constants.lateral + constants.lateral_stretch, h, LATERAL_BOUND) - soft;
  for (let k = 0; k < pairs.length; k += 2) {
    const a = 3 * pairs[k], b = 3 * pairs[k + 1];
    const x = positions[b] - positions[a], y = positions[b + 1] - positions[a + 1];
    const z = positions[b + 2] - positions[a + 2], span = Math.sqrt(x * x + y * y + z * z);
    if (span > 1e-9) {
      const pull = soft * (pairSpans[k] - span) + stiff * Math.min(pairSpans[k + 1] - span, 0);
      addSpring(pairs[k], pairs[k + 1], pull / span, inverse, springs, x, y, z);
    }
  }
}

function addShrink({ offsets, restSpans, inverse, constants }, { springs }, h, positions) {
  const constant = bounded(constants.shrink, h, SHRINK_BOUND);
  for (let c = 0; c + 1 < offsets.length; c++) {
    for (let i = offsets[c] + 1; i < offsets[c + 1]; i++) {
      const n = 3 * i, x = positions[n] - positions[n - 3], y = positions[n + 1] - positions[n - 2];
      const z = positions[n + 2] - positions[n - 1], span = Math.sqrt(x * x + y * y + z * z);
      if (1e-9 < span && span < restSpans[i]) {
        addSpring(i - 1, i, (constant * (restSpans[i] - span)) / span, inverse, springs, x, y, z);
      }
    }
  }
}

/** Pulls each rope to its rest angle to the one above, in a frame that is transported down the chain without twist. */
function addRestAngles({ offsets, restDirections, inverse, constants }, { springs, chainFrames }, h, positions) {
  const constant = bounded(constants.rest_angle, h, REST_ANGLE_BOUND);
  for (let c = 0; c + 1 < offsets.length; c++) {
    // a0..a2, b0..b2, c0..c2: rows of the carried frame
    let [a0, a1, a2, b0, b1, b2, c0, c1, c2] = chainFrames.subarray(9 * c, 9 * c + 9);
    for (let i = offsets[c] + 1; i < offsets[c + 1]; i++) {
      const n = 3 * i;
      let x = positions[n] - positions[n - 3], y = positions[n + 1] - positions[n - 2];
      let z = positions[n + 2] - positions[n - 1];
      const span = Math.sqrt(x * x + y * y + z * z);
      if (span < 1e-9) continue;
      const rx = restDirections[n], ry = restDirections[n + 1], rz = restDirections[n + 2];
      const tx = a0 * rx + a1 * ry + a2 * rz, ty = b0 * rx + b1 * ry + b2 * rz, tz = c0 * rx + c1 * ry + c2 * rz;
      if (i > offsets[c] + 1) {
        addSpring(i - 1, i, constant, inverse, springs, span * tx - x, span * ty - y, span * tz - z);
      }
      x /= span, y /= span, z /= span;
      const dot = tx * x + ty * y + tz * z;
      if (dot <= -0.99) continue;
      // turn the frame by the smallest rotation that takes t onto the rope: with w = t x l,
      // R += [w] R + [w]^2 R / (1 + dot)
      const wx = ty * z - tz * y, wy = tz * x - tx * z, wz = tx * y - ty * x, f = 1 / (1 + dot);
      const p0 = dot + f * wx * wx, p1 = f * wx * wy - wz, p2 = f * wx * wz + wy;
      const q0 = f * wx * wy + wz, q1 = dot + f * wy * wy, q2 = f * wy * wz - wx;
      const r0 = f * wx * wz - wy, r1 = f * wy * wz + wx, r2 = dot + f * wz * wz;
      [a0, b0, c0] = [p0 * a0 + p1 * b0 + p2 * c0, q0 * a0 + q1 * b0 + q2 * c0, r0 * a0 + r1 * b0 + r2 * c0];
      [a1, b1, c1] = [p0 * a1 + p1 * b1 + p2 * c1, q0 * a1 + q1 * b1 + q2 * c1, r0 * a1 + r1 * b1 + r2 * c1];
      [a2, b2, c2] = [p0 * a2 + p1 * b2 + p2 * c2, q0 * a2 + q1 * b2 + q2 * c2, r0 * a2 + r1 * b2 + r2 * c2];
    }
  }
}

/** Adds the force of the air on cloth: a = |u.n| (drag - lift |u.n| / |u|) u + lift |u| (u.n) n, u = wind - v, bounded. */
function addAir({ offsets, across, constants }, { accelerations }, h, positions, velocities) {
  const { wind, air_drag: drag, air_lift: lift } = constants;
  for (let c = 0; c + 1 < offsets.length; c++) {
    for (let i = offsets[c] + 1; i < offsets[c + 1]; i++) {
      const n = 3 * i, below = 3 * Math.min(i + 1, offsets[c + 1] - 1);
      const left = 3 * across[2 * i], right = 3 * across[2 * i + 1];
      const ax = positions[below] - positions[n - 3], ay = positions[below + 1] - positions[n - 2];
      const az = positions[below + 2] - positions[n - 1];
      const bx = positions[right] - positions[left], by = positions[right + 1] - positions[left + 1];
      const bz = positions[right + 2] - positions[left + 2];
      let nx = ay * bz - az * by, ny = az * bx - ax * bz, nz = ax * by - ay * bx;
      const size = Math.sqrt(nx * nx + ny * ny + nz * nz);
      const x = wind[0] - velocities[n], y = wind[1] - velocities[n + 1], z = wind[2] - velocities[n + 2];
      const speed = Math.sqrt(x * x + y * y + z * z);
      if (size < 1e-12 || speed < 1e-12) continue;
      nx /= size, ny /= size, nz /= size;
      const facing = x * nx + y * ny + z * nz, lifted = lift * speed;
      const plain = Math.abs(facing) * Math.max(drag - (lift * Math.abs(facing)) / speed, 0);
      const fraction = 1 / (1 + 0.5 * h * (plain + lifted)), along = fraction * plain, up = fraction * lifted * facing;
      accelerations[n] += along * x + up * nx;
      accelerations[n + 1] += along * y + up * ny;
      accelerations[n + 2] += along * z + up * nz;
    }
  }
}

/** Damps each node towards the mean velocity of its neighbours on all four sides; momentum is conserved. */
function addSmoothing({ offsets, across, inverse, constants }, { accelerations }, h, velocities) {
  const down = constants.bend_damping / (1 + 4 * h * constants.bend_damping);
  const side = constants.lateral_damping / (1 + 4 * h * constants.lateral_damping);
  for (let c = 0; c + 1 < offsets.length; c++) {
    for (let i = offsets[c] + 1; i < offsets[c + 1]; i++) {
      if (i + 1 < offsets[c + 1]) smoothNode(i, i - 1, i + 1, down, inverse, velocities, accelerations);
      const a = across[2 * i], b = across[2 * i + 1];
      if (a !== i && b !== i) smoothNode(i, a, b, side, inverse, velocities, accelerations);
    }
  }
}

function smoothNode(i, a, b, rate, inverse, velocities, out) {
  for (let d = 0; d < 3; d++) {
    const away = rate * (velocities[3 * i + d] - 0.5 * (velocities[3 * a + d] + velocities[3 * b + d]));
    out[3 * i + d] -= away;
    out[3 * a + d] += (0.5 * away * inverse[a]) / inverse[i];
    out[3 * b + d] += (0.5 * away * inverse[b]) / inverse[i];
  }
}
