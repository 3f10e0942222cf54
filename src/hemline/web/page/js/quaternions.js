// Unit quaternions wxyz, plain arrays of four numbers.

export function multiply([w, x, y, z], [a, b, c, d]) {
  return [
    w * a - x * b - y * c - z * d, w * b + x * a + y * d - z * c,
    w * c - x * d + y * a + z * b, w * d + x * c - y * b + z * a,
  ];
}

export const inverse = ([w, x, y, z]) => [w, -x, -y, -z];

export function normalised(q) {
  const size = Math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  return q.map((value) => value / size);
}

/** Interpolates rotations on the shorter path at constant angular speed (Shoemake 1985). */
export function slerp(start, end, fraction) {
  let cosine = start[0] * end[0] + start[1] * end[1] + start[2] * end[2] + start[3] * end[3];
  const sign = cosine < 0 ? -1 : 1;
  cosine = Math.min(Math.abs(cosine), 1);
  const theta = Math.acos(cosine), near = theta < 1e-4, sine = Math.sin(theta);
  const first = near ? 1 - fraction : Math.sin((1 - fraction) * theta) / sine;
  const second = sign * (near ? fraction : Math.sin(fraction * theta) / sine);
  return normalised([0, 1, 2, 3].map((i) => first * start[i] + second * end[i]));
}

/** Returns the rotation matrix, row by row. */
export function toMatrix([w, x, y, z]) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
    2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y),
  ];
}

/** Returns quaternion `joint` of an array. */
export const at = (rotations, joint) => [0, 1, 2, 3].map((i) => rotations[4 * joint + i]);
