// Motion of one node: exact rotation on the sphere of a taut rope; animators/ropes/turn_kernels (paper, Eq. 10 to 13).

const offset = new Float64Array(3);

/** Moves node i from `starts` to `positions` in a time h; node i - 1 has been moved already. */
export function moveNode(i, length, pulling, project, h, starts, velocities, positions) {
  const n = 3 * i, p = n - 3;
  let x = starts[n] - starts[p], y = starts[n + 1] - starts[p + 1], z = starts[n + 2] - starts[p + 2];
  let vx = velocities[n], vy = velocities[n + 1], vz = velocities[n + 2], left = h;
  if (pulling) {
    vx -= velocities[p], vy -= velocities[p + 1], vz -= velocities[p + 2];
  } else {
    vx -= (positions[p] - starts[p]) / h;
    vy -= (positions[p + 1] - starts[p + 1]) / h;
    vz -= (positions[p + 2] - starts[p + 2]) / h;
    const a = vx * vx + vy * vy + vz * vz, b = vx * x + vy * y + vz * z, c = x * x + y * y + z * z - length * length;
    if (a * h * h + 2 * b * h + c <= 0) {
      positions[n] = positions[p] + x + h * vx;
      positions[n + 1] = positions[p + 1] + y + h * vy;
      positions[n + 2] = positions[p + 2] + z + h * vz;
      return;
    }
    let root = 0;
    if (a > 0 && b * b - a * c >= 0) {
      const far = (-b + Math.sqrt(b * b - a * c)) / a, near = (-b - Math.sqrt(b * b - a * c)) / a;
      root = 0 <= far && far <= h ? far : 0 <= near && near <= h ? near : 0;
    }
    x += root * vx, y += root * vy, z += root * vz;
    left -= root;
  }
  if (x * x + y * y + z * z < 1e-24) x = 0, y = -1, z = 0;
  if (project) putBack(x, y, z, vx, vy, vz, left, length);
  else turnAbout(x, y, z, vx, vy, vz, left, length);
  for (let d = 0; d < 3; d++) positions[n + d] = positions[p + d] + offset[d];
}

function turnAbout(x, y, z, vx, vy, vz, time, length) {
  const size = Math.sqrt(x * x + y * y + z * z);
  x /= size, y /= size, z /= size;
  const along = vx * x + vy * y + vz * z, tx = vx - along * x, ty = vy - along * y, tz = vz - along * z;
  const speed = Math.sqrt(tx * tx + ty * ty + tz * tz);
  let cosine = length, sine = 0;
  if (speed >= 1e-14) {
    const angle = (speed * time) / length;
    cosine = length * Math.cos(angle), sine = (length * Math.sin(angle)) / speed;
  }
  offset[0] = cosine * x + sine * tx, offset[1] = cosine * y + sine * ty, offset[2] = cosine * z + sine * tz;
}

function putBack(x, y, z, vx, vy, vz, time, length) {
  x += time * vx, y += time * vy, z += time * vz;
  const factor = length / Math.sqrt(x * x + y * y + z * z);
  offset[0] = factor * x, offset[1] = factor * y, offset[2] = factor * z;
}
