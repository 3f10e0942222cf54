// Pushes rope nodes out of the cones, from root to tip; push_out_kernels, rope_collision_kernels (paper, section 6).

import { distance, closest, worldNormal } from "hemline/cones.js";
import { point, toRest, toWorld, rotateToWorld } from "hemline/joint_frames.js";

const GRADIENT = 0, HISTORY = 1, SLIDE = 2;
const TOUCH = 1e-9, REMEMBERED = 4, ATTEMPTS = 24, LONGEST = 1.2, FRACTIONS = [1, 0.5, 0.25, 0], TURNS = 16;
const DIRECTIONS = Array.from({ length: 64 }, (_, k) => {
  const height = (2 * k + 1) / 64 - 1, angle = k * Math.PI * (3 - Math.sqrt(5)), flat = Math.sqrt(1 - height ** 2);
  return [flat * Math.cos(angle), height, flat * Math.sin(angle)];
});

/** Contact of one chain in one substep, after its lengths. `from` and `to` are the frames of the joints at its ends. */
export class Contact {
  constructor(cones, placed, constants) {
    Object.assign(this, { cones, placed, friction: constants.friction });
    this.pushMode = ["gradient", "history", "slide"].indexOf(constants.position_push);
    this.velocityMode = ["gradient", "history"].indexOf(constants.velocity_push);
    this.which = -1;
    this.depth = 0;
  }

  /** Resolve nodes a + 1 .. b - 1; returns whether any touched. */
  resolve(a, b, lengths, margins, from, to, h, starts, positions, velocities) {
    Object.assign(this, { from, to, h });
    let any = false;
    for (let i = a + 1; i < b; i++) {
      const n = 3 * i, ax = positions[n - 3], ay = positions[n - 2], az = positions[n - 1];
      let span = Math.sqrt((positions[n] - ax) ** 2 + (positions[n + 1] - ay) ** 2 + (positions[n + 2] - az) ** 2);
      if (span > lengths[i] * (1 + 1e-12)) {
        const fraction = lengths[i] / span;
        positions[n] = ax + fraction * (positions[n] - ax);
        positions[n + 1] = ay + fraction * (positions[n + 1] - ay);
        positions[n + 2] = az + fraction * (positions[n + 2] - az);
      }
      const pushCount = this.#free(margins[i], n, starts, positions, velocities);
      if (pushCount === 0) continue;
      any = true;
      const by = this.last;
      span = Math.sqrt((positions[n] - ax) ** 2 + (positions[n + 1] - ay) ** 2 + (positions[n + 2] - az) ** 2);
      if (pushCount === ATTEMPTS || span > LONGEST * lengths[i]) {
        this.#release(margins[i], lengths[i], ax, ay, az, n, positions);
      }
      this.#slowDown(by, n, starts, positions, velocities);
    }
    return any;
  }

  /** Pushes a node out, deepest cone first; returns the number of pushes. `last` is the last cone. */
  #free(margin, n, starts, positions, velocities) {
    this.last = -1;
    const sx = starts[n], sy = starts[n + 1], sz = starts[n + 2];
    for (let attempt = 0; attempt < ATTEMPTS; attempt++) {
      const mode = attempt < REMEMBERED ? this.pushMode : GRADIENT;
      this.#deepest(this.from, margin, mode, sx, sy, sz, positions[n], positions[n + 1], positions[n + 2]);
      if (this.which < 0) return attempt;
      this.last = this.which;
      this.#pushOut(this.which, margin, mode, n, starts, positions, velocities);
    }
    return ATTEMPTS;
  }

  /** Finds the deepest cone, `which` (-1: none), and its `depth`; a path right through a cone counts with the part beyond it. */
  #deepest(from, margin, mode, sx, sy, sz, x, y, z) {
    const { placed } = this, { gap: gaps, travel: travels } = placed;
    let worst = -TOUCH, which = -1;
    placed.measure(sx, sy, sz, x, y, z);
    for (let k = 0; k < placed.count; k++) {
      const gap = gaps[k] - margin;
      if (gap >= travels[k]) continue;
      if (gap < worst) {
        worst = gap, which = k;
      } else if (mode !== GRADIENT && gap < travels[k]) {
        const through = this.#crossing(k, from, margin, gap, sx, sy, sz, x, y, z);
        if (-through < worst) worst = -through, which = k;
      }
    }
    this.which = which, this.depth = worst;
  }

  #crossing(k, from, margin, gap, sx, sy, sz, x, y, z) {
    const j = this.cones.joints[k];
    toRest(this.to, j, x, y, z);
    const px = point[0], py = point[1], pz = point[2];
    toRest(from, j, sx, sy, sz);
    const qx = point[0], qy = point[1], qz = point[2];
    const length = Math.sqrt((px - qx) ** 2 + (py - qy) ** 2 + (pz - qz) ** 2);
    if (gap >= length) return 0;
    distance(this.cones.shapes, k, qx, qy, qz);
    const before = closest[0] - margin;
    if (before <= 1e-6 || before + gap >= length) return 0;
    return Math.max(0, 1 - this.#firstContact(k, margin, qx, qy, qz, px, py, pz)) * length;
  }

  /** Returns the fraction of a path at which it meets the cone grown by a margin, by Newton's method; 2 if it does not. */
  #firstContact(k, margin, ax, ay, az, bx, by, bz) {
    const x = bx - ax, y = by - ay, z = bz - az;
    let fraction = 0;
    for (let round = 0; round < 20; round++) {
      distance(this.cones.shapes, k, ax + fraction * x, ay + fraction * y, az + fraction * z);
      const gap = closest[0] - margin;
      if (gap < 1e-7) return fraction;
      const slope = closest[1] * x + closest[2] * y + closest[3] * z;
      if (slope >= 0) return 2;
      fraction -= gap / slope;
      if (fraction > 1) return 2;
    }
    return fraction;
  }

  #pushOut(k, margin, mode, n, starts, positions, velocities) {
    const { from, to, h, friction } = this, { shapes, joints } = this.cones, j = joints[k];
    toRest(to, j, positions[n], positions[n + 1], positions[n + 2]);
    const px = point[0], py = point[1], pz = point[2];
    toRest(from, j, starts[n], starts[n + 1], starts[n + 2]);
    const qx = point[0], qy = point[1], qz = point[2];
    distance(shapes, k, px, py, pz);
    let nx = closest[1], ny = closest[2], nz = closest[3];
    const depth = margin - closest[0];
    let ex = px + depth * nx, ey = py + depth * ny, ez = pz + depth * nz;
    const rx = qx - px, ry = qy - py, rz = qz - pz, size = Math.sqrt(rx * rx + ry * ry + rz * rz);
    distance(shapes, k, qx, qy, qz);
    const outside = size > 1e-12 && closest[0] - margin >= -1e-6;
    if (mode !== GRADIENT && outside) {
      const fraction = Math.min(this.#firstContact(k, margin, qx, qy, qz, px, py, pz), 1);
      ex = qx - fraction * rx, ey = qy - fraction * ry, ez = qz - fraction * rz;
      distance(shapes, k, ex, ey, ez);
      nx = closest[1], ny = closest[2], nz = closest[3];
      const lift = Math.max(margin - closest[0], 0);
      ex += lift * nx, ey += lift * ny, ez += lift * nz;
      if (mode === SLIDE) {
        // the rest of the path runs along the tangent plane, which a convex cone never crosses
        let tx = px - ex, ty = py - ey, tz = pz - ez;
        const inward = Math.min(tx * nx + ty * ny + tz * nz, 0);
        tx -= inward * nx, ty -= inward * ny, tz -= inward * nz;
        const rest = Math.sqrt(tx * tx + ty * ty + tz * tz);
        const remaining = rest > 1e-12 ? Math.max(0, 1 + (friction * inward) / rest) : 0;
        ex += remaining * tx, ey += remaining * ty, ez += remaining * tz;
      }
    }
    if (this.velocityMode === HISTORY && outside) nx = rx / size, ny = ry / size, nz = rz / size;
    toWorld(from, j, ex, ey, ez);
    const ax = point[0], ay = point[1], az = point[2];
    toWorld(to, j, ex, ey, ez);
    const bx = point[0], by = point[1], bz = point[2];
    rotateToWorld(to, j, nx, ny, nz);
    touchVelocity(point[0], point[1], point[2], (bx - ax) / h, (by - ay) / h, (bz - az) / h, friction, n, velocities);
    positions[n] = bx, positions[n + 1] = by, positions[n + 2] = bz;
  }

  /** Limits the velocity along the surface to that of the actual motion. */
  #slowDown(k, n, starts, positions, velocities) {
    const { from, to, h, cones } = this, j = cones.joints[k];
    toRest(to, j, positions[n], positions[n + 1], positions[n + 2]);
    toWorld(from, j, point[0], point[1], point[2]);
    const ax = point[0], ay = point[1], az = point[2];
    const bx = (positions[n] - ax) / h, by = (positions[n + 1] - ay) / h, bz = (positions[n + 2] - az) / h;
    worldNormal(cones, k, to, positions[n], positions[n + 1], positions[n + 2]);
    const nx = point[0], ny = point[1], nz = point[2];
    let vx = velocities[n] - bx, vy = velocities[n + 1] - by, vz = velocities[n + 2] - bz;
    const along = vx * nx + vy * ny + vz * nz;
    vx -= along * nx, vy -= along * ny, vz -= along * nz;
    let wx = (ax - starts[n]) / h, wy = (ay - starts[n + 1]) / h, wz = (az - starts[n + 2]) / h;
    const inward = wx * nx + wy * ny + wz * nz;
    wx -= inward * nx, wy -= inward * ny, wz -= inward * nz;
    if (wx * wx + wy * wy + wz * wz < vx * vx + vy * vy + vz * vz) {
      velocities[n] = bx + along * nx + wx;
      velocities[n + 1] = by + along * ny + wy;
      velocities[n + 2] = bz + along * nz + wz;
    }
  }

  /** Releases a caught node: to the nearest free point within the length of the rope, otherwise straight out. */
  #release(margin, length, ax, ay, az, n, positions) {
    for (const fraction of FRACTIONS) if (this.#rotateFree(margin, fraction * length, ax, ay, az, n, positions)) return;
    this.#moveStraightOut(margin, n, positions);
  }

  #rotateFree(margin, reach, ax, ay, az, n, positions) {
    let x = positions[n] - ax, y = positions[n + 1] - ay, z = positions[n + 2] - az;
    const far = Math.sqrt(x * x + y * y + z * z);
    if (far > 1e-12) x /= far, y /= far, z /= far;
    else x = 0, y = -1, z = 0;
    let p = x, q = y, r = z;
    for (let turn = 0; turn < TURNS; turn++) {
      const u = ax + reach * p, v = ay + reach * q, w = az + reach * r;
      this.#deepest(this.to, margin, GRADIENT, u, v, w, u, v, w);
      if (this.which < 0) {
        positions[n] = u, positions[n + 1] = v, positions[n + 2] = w;
        return true;
      }
      worldNormal(this.cones, this.which, this.to, u, v, w);
      let nx = point[0], ny = point[1], nz = point[2];
      const along = nx * p + ny * q + nz * r;
      nx -= along * p, ny -= along * q, nz -= along * r;
      const square = nx * nx + ny * ny + nz * nz;
      if (square < 1e-6 || reach === 0) break;
      const by = Math.min((1e-6 - this.depth) / (reach * square), 0.5 / Math.sqrt(square));
      p += by * nx, q += by * ny, r += by * nz;
      const size = Math.sqrt(p * p + q * q + r * r);
      p /= size, q /= size, r /= size;
    }
    let nearest = -2;
    for (const [a, b, c] of DIRECTIONS) {
      const near = a * x + b * y + c * z;
      if (near <= nearest) continue;
      const u = ax + reach * a, v = ay + reach * b, w = az + reach * c;
      this.#deepest(this.to, margin, GRADIENT, u, v, w, u, v, w);
      if (this.which < 0) {
        nearest = near;
        positions[n] = u, positions[n + 1] = v, positions[n + 2] = w;
      }
    }
    return nearest > -2;
  }

  #moveStraightOut(margin, n, positions) {
    let nx = 0, ny = 0, nz = 0;
    for (let round = 0; round < 80; round++) {
      const x = positions[n], y = positions[n + 1], z = positions[n + 2];
      this.#deepest(this.to, margin, GRADIENT, x, y, z, x, y, z);
      if (this.which < 0) return;
      const step = 1e-6 - this.depth;
      if (nx === 0 && ny === 0 && nz === 0) {
        worldNormal(this.cones, this.which, this.to, x, y, z);
        nx = point[0], ny = point[1], nz = point[2];
      }
      positions[n] = x + step * nx, positions[n + 1] = y + step * ny, positions[n + 2] = z + step * nz;
    }
  }
}

/** Sets the velocity of a node at a surface with normal n and velocity b, with Coulomb friction (Eq. 14 to 16). */
function touchVelocity(nx, ny, nz, bx, by, bz, friction, n, velocities) {
  const along = velocities[n] * nx + velocities[n + 1] * ny + velocities[n + 2] * nz;
  const body = bx * nx + by * ny + bz * nz, fresh = Math.max(along, body);
  const x = velocities[n] - along * nx - (bx - body * nx);
  const y = velocities[n + 1] - along * ny - (by - body * ny);
  const z = velocities[n + 2] - along * nz - (bz - body * nz);
  const size = Math.sqrt(x * x + y * y + z * z);
  const remaining = size > 1e-12 ? Math.max(0, 1 - (friction * (fresh - along)) / size) : 0;
  velocities[n] = fresh * nx + (bx - body * nx) + remaining * x;
  velocities[n + 1] = fresh * ny + (by - body * ny) + remaining * y;
  velocities[n + 2] = fresh * nz + (bz - body * nz) + remaining * z;
}
