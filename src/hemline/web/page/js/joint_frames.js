// Points in the frames of joints, and frames between two poses; animators/ropes/joint_frame_kernels.
// Frames are (joints, 3, 4), float64. Each function leaves its three numbers in `point`.

export const point = new Float64Array(3);

export function toRest(frames, joint, x, y, z) {
  const f = 12 * joint, a = x - frames[f + 3], b = y - frames[f + 7], c = z - frames[f + 11];
  point[0] = frames[f] * a + frames[f + 4] * b + frames[f + 8] * c;
  point[1] = frames[f + 1] * a + frames[f + 5] * b + frames[f + 9] * c;
  point[2] = frames[f + 2] * a + frames[f + 6] * b + frames[f + 10] * c;
}

export function rotateToWorld(frames, joint, x, y, z) {
  const f = 12 * joint;
  point[0] = frames[f] * x + frames[f + 1] * y + frames[f + 2] * z;
  point[1] = frames[f + 4] * x + frames[f + 5] * y + frames[f + 6] * z;
  point[2] = frames[f + 8] * x + frames[f + 9] * y + frames[f + 10] * z;
}

export function toWorld(frames, joint, x, y, z) {
  rotateToWorld(frames, joint, x, y, z);
  for (let a = 0; a < 3; a++) point[a] += frames[12 * joint + 4 * a + 3];
}

/** Transforms points from the world to the frame of a joint: R^T (x - t). */
export function intoJoint(frames, joint, points) {
  const out = new Float64Array(points.length);
  for (let i = 0; i < points.length; i += 3) {
    toRest(frames, joint, points[i], points[i + 1], points[i + 2]);
    out.set(point, i);
  }
  return out;
}

/** Interpolates frames: pivots on straight lines, rotations by slerp. */
export function framesBetween(from, to, pivots, fraction, out) {
  if (fraction >= 1) {
    out.set(to);
    return;
  }
  for (let j = 0; 3 * j < pivots.length; j++) {
    const one = quaternionOf(from, j), two = quaternionOf(to, j), f = 12 * j;
    const dot = one[0] * two[0] + one[1] * two[1] + one[2] * two[2] + one[3] * two[3], sign = dot >= 0 ? 1 : -1;
    const angle = Math.acos(Math.min(Math.abs(dot), 1));
    let first = 1 - fraction, second = fraction * sign;
    if (angle > 1e-6) {
      first = Math.sin((1 - fraction) * angle) / Math.sin(angle);
      second = (sign * Math.sin(fraction * angle)) / Math.sin(angle);
    }
    const [w, x, y, z] = one.map((value, i) => first * value + second * two[i]);
    const n = 2 / Math.max(w * w + x * x + y * y + z * z, 1e-30);
    out[f] = 1 - n * (y * y + z * z), out[f + 1] = n * (x * y - w * z), out[f + 2] = n * (x * z + w * y);
    out[f + 4] = n * (x * y + w * z), out[f + 5] = 1 - n * (x * x + z * z), out[f + 6] = n * (y * z - w * x);
    out[f + 8] = n * (x * z - w * y), out[f + 9] = n * (y * z + w * x), out[f + 10] = 1 - n * (x * x + y * y);
    const px = pivots[3 * j], py = pivots[3 * j + 1], pz = pivots[3 * j + 2];
    toWorld(from, j, px, py, pz);
    const start = [...point];
    toWorld(to, j, px, py, pz);
    for (let a = 0; a < 3; a++) {
      const r = f + 4 * a, position = start[a] + fraction * (point[a] - start[a]);
      out[r + 3] = position - (out[r] * px + out[r + 1] * py + out[r + 2] * pz);
    }
  }
}

function quaternionOf(m, joint) {
  const f = 12 * joint, a = m[f], b = m[f + 5], c = m[f + 10];
  const x = m[f + 9] - m[f + 6], y = m[f + 2] - m[f + 8], z = m[f + 4] - m[f + 1];
  const xy = m[f + 1] + m[f + 4], xz = m[f + 2] + m[f + 8], yz = m[f + 6] + m[f + 9];
  if (a + b + c > 0) {
    const s = 2 * Math.sqrt(1 + a + b + c);
    return [s / 4, x / s, y / s, z / s];
  }
  if (a >= b && a >= c) {
    const s = 2 * Math.sqrt(1 + a - b - c);
    return [x / s, s / 4, xy / s, xz / s];
  }
  if (b >= c) {
    const s = 2 * Math.sqrt(1 - a + b - c);
    return [y / s, xy / s, s / 4, yz / s];
  }
  const s = 2 * Math.sqrt(1 - a - b + c);
  return [z / s, xz / s, yz / s, s / 4];
}
