// Rounded cones, the colliders of bones; collide/primitives/primitive_kernels and animators/ropes/placed_kernels.
// Shapes are (cones, 16): centres a and b, radii there.

import { point, toRest, toWorld, rotateToWorld } from "hemline/joint_frames.js";

/** Result of `distance`: the distance to a cone in the rest frame of its joint, and its gradient. */
export const closest = new Float64Array(4);

export function distance(shapes, k, x, y, z) {
  const s = 16 * k;
  let ux = shapes[s + 3] - shapes[s], uy = shapes[s + 4] - shapes[s + 1], uz = shapes[s + 5] - shapes[s + 2];
  let px = x - shapes[s], py = y - shapes[s + 1], pz = z - shapes[s + 2], radius = shapes[s + 6];
  const length = Math.sqrt(ux * ux + uy * uy + uz * uz), difference = shapes[s + 6] - shapes[s + 7];
  if (length <= Math.abs(difference) || length < 1e-12) {
    if (difference < 0) {
      px = x - shapes[s + 3], py = y - shapes[s + 4], pz = z - shapes[s + 5], radius = shapes[s + 7];
    }
  } else {
    ux /= length, uy /= length, uz /= length;
    const slope = difference / length, along = px * ux + py * uy + pz * uz;
    let qx = px - along * ux, qy = py - along * uy, qz = pz - along * uz;
    const q = Math.sqrt(qx * qx + qy * qy + qz * qz), cosine = Math.sqrt(1 - slope * slope);
    const foot = along - (q * slope) / cosine;
    if (foot >= length) {
      px = x - shapes[s + 3], py = y - shapes[s + 4], pz = z - shapes[s + 5], radius = shapes[s + 7];
    } else if (foot > 0) {
      let size = q;
      if (q < 1e-12) {
        // on the axis, any direction across it will do
        qx = uy - uz, qy = uz - ux, qz = ux - uy;
        if (Math.abs(qx) + Math.abs(qy) + Math.abs(qz) < 1e-6) qx = uy, qy = -ux, qz = 0;
        size = Math.sqrt(qx * qx + qy * qy + qz * qz);
      }
      const side = cosine / size;
      closest[0] = q * cosine + along * slope - shapes[s + 6];
      closest[1] = side * qx + slope * ux, closest[2] = side * qy + slope * uy, closest[3] = side * qz + slope * uz;
      return;
    }
  }
  const size = Math.sqrt(px * px + py * py + pz * pz);
  if (size < 1e-12) {
    closest[0] = -radius, closest[1] = 0, closest[2] = 1, closest[3] = 0;
    return;
  }
  closest[0] = size - radius, closest[1] = px / size, closest[2] = py / size, closest[3] = pz / size;
}

/** Gradient of the distance to cone k at a point in the world, left in `point`. */
export function worldNormal(cones, k, frames, x, y, z) {
  toRest(frames, cones.joints[k], x, y, z);
  distance(cones.shapes, k, point[0], point[1], point[2]);
  rotateToWorld(frames, cones.joints[k], closest[1], closest[2], closest[3]);
}

/** All cones in the world at the end of a substep, and the motion of each within it. */
export class PlacedCones {
  constructor(cones) {
    const count = (this.count = cones.joints.length);
    this.cones = cones;
    // start, unit axis, length, sine and cosine of the side's slope, radii; middle, motion of the middle, chord of the rotation
    this.rows = new Float64Array(18 * count);
    this.gap = new Float64Array(count);
    this.travel = new Float64Array(count);
  }

  place(from, to) {
    const { joints, shapes } = this.cones, rows = this.rows;
    for (let k = 0; k < this.count; k++) {
      const j = joints[k], r = 18 * k;
      this.#placeCone(shapes, to, j, k);
      for (let n = 0; n < 3; n++) {
        const middle = rows[r + n] + 0.5 * rows[r + 6] * rows[r + 3 + n];
        rows[r + 14 + n] = middle - rows[r + 11 + n], rows[r + 11 + n] = middle;
      }
      let turn = 0;
      for (let a = 0; a < 3; a++) {
        for (let b = 0; b < 3; b++) turn += (to[12 * j + 4 * a + b] - from[12 * j + 4 * a + b]) ** 2;
      }
      rows[r + 17] = Math.min(Math.sqrt(turn), 1);
    }
  }

  #placeCone(shapes, frames, j, k) {
    const rows = this.rows, r = 18 * k, s = 16 * k;
    toWorld(frames, j, shapes[s], shapes[s + 1], shapes[s + 2]);
    let x = point[0], y = point[1], z = point[2];
    toWorld(frames, j, shapes[s + 3], shapes[s + 4], shapes[s + 5]);
    const u = point[0], v = point[1], w = point[2];
    let first = shapes[s + 6], square = 0;
    const second = shapes[s + 7];
    for (let n = 0; n < 3; n++) square += (shapes[s + n + 3] - shapes[s + n]) ** 2;
    const length = Math.sqrt(square);
    if (length < Math.abs(first - second) + 1e-9) {
      if (second > first) x = u, y = v, z = w, first = second;
      rows.set([x, y, z, 0, 0, 0, 0, 0, 1, first, first], r);
      return;
    }
    const slope = (first - second) / length, cosine = Math.sqrt(1 - slope * slope);
    rows.set([x, y, z, (u - x) / length, (v - y) / length, (w - z) / length, length, slope, cosine, first, second], r);
  }

  /** For a node moved from (sx, sy, sz) to (x, y, z): `gap`, its distance to each cone; `travel`, a bound of its motion. */
  measure(sx, sy, sz, x, y, z) {
    const { rows, gap, travel, count } = this, dx = x - sx, dy = y - sy, dz = z - sz;
    for (let k = 0, r = 0; k < count; k++, r += 18) {
      const px = x - rows[r], py = y - rows[r + 1], pz = z - rows[r + 2];
      const ux = rows[r + 3], uy = rows[r + 4], uz = rows[r + 5], length = rows[r + 6];
      const along = px * ux + py * uy + pz * uz;
      const qx = px - along * ux, qy = py - along * uy, qz = pz - along * uz, square = qx * qx + qy * qy + qz * qz;
      const across = Math.sqrt(square), slope = rows[r + 7], cosine = rows[r + 8];
      const foot = along * cosine - across * slope;
      if (foot > 0 && foot < length * cosine) {
        gap[k] = across * cosine + along * slope - rows[r + 9];
      } else {
        const beyond = foot > 0 ? along - length : along;
        gap[k] = Math.sqrt(square + beyond * beyond) - (foot > 0 ? rows[r + 10] : rows[r + 9]);
      }
      const mx = dx - rows[r + 14], my = dy - rows[r + 15], mz = dz - rows[r + 16];
      // upper bound of the distance from the middle: along the axis, then across
      const away = across + Math.abs(along - 0.5 * length);
      travel[k] = Math.sqrt(mx * mx + my * my + mz * mz) + rows[r + 17] * away;
    }
  }
}
