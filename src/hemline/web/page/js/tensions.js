// The tridiagonal inequalities of one rope chain; animators/ropes/tension_kernels (paper, Eq. 1 to 9).
// A chain has the nodes from its root `a` to before `b` in all arrays.

/** Computes unit directions, spans, slack, taut flags and the matrix of one chain. */
export function readChain(w, a, b, lengths, inverse, positions) {
  const { directions, spans, slack, diagonal, beside, taut } = w;
  taut[a] = 0;
  for (let i = a + 1; i < b; i++) {
    const n = 3 * i, x = positions[n] - positions[n - 3], y = positions[n + 1] - positions[n - 2];
    const z = positions[n + 2] - positions[n - 1], span = Math.sqrt(x * x + y * y + z * z);
    spans[i] = span, slack[i] = Math.max(lengths[i] - span, 0);
    taut[i] = span >= lengths[i] * (1 - 0.01) ? 1 : 0;
    if (span < 1e-12) directions[n] = 0, directions[n + 1] = -1, directions[n + 2] = 0;
    else directions[n] = x / span, directions[n + 1] = y / span, directions[n + 2] = z / span;
  }
  for (let i = a + 1; i < b; i++) {
    const n = 3 * i;
    diagonal[i] = (i > a + 1 ? inverse[i - 1] : 0) + inverse[i];
    beside[i] = 0;
    if (i < b - 1) {
      const dot = directions[n] * directions[n + 3] + directions[n + 1] * directions[n + 4];
      beside[i] = -(dot + directions[n + 2] * directions[n + 5]) * inverse[i];
    }
  }
}

/** Solves for the smallest values >= 0 with A values >= wanted on taut ropes, by block pivoting; signless ones have any sign. */
export function solveDirect(w, a, b, wanted, signless, values) {
  const { diagonal, beside, taut, active, upper } = w, last = b - 1, count = last - a;
  let scale = 0, idle = true;
  for (let i = a + 1; i <= last; i++) {
    active[i] = taut[i] && (signless[i] || wanted[i] > 0 || values[i] > 0) ? 1 : 0;
    scale = Math.max(scale, Math.abs(wanted[i]));
    idle &&= !active[i];
  }
  if (idle) {
    values.fill(0, a + 1, b);
    return;
  }
  const slack = 1e-13 * scale;
  for (let best = count + 1, patience = 3, rounds = 0; rounds < 4 * count + 20; rounds++) {
    solveActive(w, a, b, wanted, values);
    let wrong = 0, furthest = 0;
    for (let i = a + 1; i <= last; i++) {
      if (!taut[i] || signless[i]) continue;
      let bad = values[i] * diagonal[i] < -slack;
      if (!active[i]) {
        let there = i > a + 1 ? beside[i - 1] * values[i - 1] : 0;
        there += i < last ? beside[i] * values[i + 1] : 0;
        bad = wanted[i] - there > slack;
      }
      if (bad) wrong++, furthest = i, upper[i] = 1e300;
    }
    if (wrong === 0) break;
    let single = wrong >= best;
    if (wrong < best) best = wrong, patience = 3;
    else if (patience > 0) patience--, single = false;
    for (let i = a + 1; i <= last; i++) {
      if (upper[i] === 1e300 && (!single || i === furthest)) active[i] = active[i] ? 0 : 1;
    }
  }
  for (let i = a + 1; i <= last; i++) if (!signless[i] && values[i] < 0) values[i] = 0;
}

function solveActive({ diagonal, beside, active, upper }, a, b, wanted, values) {
  const last = b - 1;
  let previous = 0;
  for (let i = a + 1; i <= last; i++) {
    if (!active[i]) {
      values[i] = previous = upper[i] = 0;
      continue;
    }
    const coupled = i > a + 1 && active[i - 1], side = coupled ? beside[i - 1] : 0;
    const pivot = diagonal[i] - side * (coupled ? upper[i - 1] : 0);
    upper[i] = i < last && active[i + 1] ? beside[i] / pivot : 0;
    values[i] = previous = (wanted[i] - side * previous) / pivot;
  }
  for (let i = last - 1; i > a; i--) if (active[i]) values[i] -= upper[i] * values[i + 1];
}

/** Improves such values by Gauss-Seidel sweeps, from tip to root or from root to tip. */
export function solveSweeps({ diagonal, beside, taut }, a, b, wanted, signless, sweeps, fromTip, values) {
  const last = b - 1;
  for (let i = a + 1; i <= last; i++) if (!taut[i]) values[i] = 0;
  for (let sweep = 0; sweep < sweeps; sweep++) {
    for (let k = a + 1; k <= last; k++) {
      const i = fromTip ? last + a + 1 - k : k;
      if (!taut[i]) continue;
      let value = wanted[i];
      if (i > a + 1) value -= beside[i - 1] * values[i - 1];
      if (i < last) value -= beside[i] * values[i + 1];
      value /= diagonal[i];
      values[i] = signless[i] ? value : Math.max(0, value);
    }
  }
}

/** Computes the right-hand side for the tensions, with the rotation of a time `ahead`. */
export function tensionDemand(w, a, b, inverse, tensions, velocities, h, ahead, wanted) {
  const { directions, spans, slack, accelerations } = w;
  for (let i = a + 1; i < b; i++) {
    const n = 3 * i, dx = directions[n], dy = directions[n + 1], dz = directions[n + 2];
    let ax = accelerations[n] - accelerations[n - 3], ay = accelerations[n + 1] - accelerations[n - 2];
    let az = accelerations[n + 2] - accelerations[n - 1];
    let vx = velocities[n] - velocities[n - 3], vy = velocities[n + 1] - velocities[n - 2];
    let vz = velocities[n + 2] - velocities[n - 1];
    const away = vx * dx + vy * dy + vz * dz - slack[i] / h, pulled = ax * dx + ay * dy + az * dz;
    const radius = Math.max(spans[i], 1e-9);
    if (i > a + 1) {
      const above = inverse[i - 1] * tensions[i - 1];
      ax += above * directions[n - 3], ay += above * directions[n - 2], az += above * directions[n - 1];
    }
    if (i < b - 1) {
      const below = inverse[i] * tensions[i + 1];
      ax += below * directions[n + 3], ay += below * directions[n + 4], az += below * directions[n + 5];
    }
    vx += ahead * ax, vy += ahead * ay, vz += ahead * az;
    const along = vx * dx + vy * dy + vz * dz;
    const speed = Math.sqrt(Math.max(vx * vx + vy * vy + vz * vz - along * along, 0));
    const turn = (2 / h) * speed * tangent(Math.min((0.5 * h * speed) / radius, 0.8));
    wanted[i] = pulled + turn + (2 / h) * Math.min(away, 0);
  }
}

/** Computes how fast each rope lengthens beyond its slack within the step (Eq. 7). */
export function impulseDemand({ directions, slack }, a, b, velocities, h, wanted) {
  for (let i = a + 1; i < b; i++) {
    const n = 3 * i;
    wanted[i] = (velocities[n] - velocities[n - 3]) * directions[n]
      + (velocities[n + 1] - velocities[n - 2]) * directions[n + 1]
      + (velocities[n + 2] - velocities[n - 1]) * directions[n + 2] - slack[i] / h;
  }
}

/** Changes velocities by tensions over `time`, or by impulses with time 1 (Eq. 2 and 6). */
export function pull({ directions }, a, b, inverse, values, time, velocities) {
  for (let i = a + 1; i < b; i++) {
    const factor = time * inverse[i];
    for (let n = 3 * i; n < 3 * i + 3; n++) {
      let force = -values[i] * directions[n];
      if (i < b - 1) force += values[i + 1] * directions[n + 3];
      velocities[n] += factor * force;
    }
  }
}

function tangent(angle) {
  const square = angle * angle;
  if (square >= 0.01) return Math.tan(angle);
  return angle * (1 + square * (1 / 3 + square * (2 / 15 + (square * 17) / 315)));
}
