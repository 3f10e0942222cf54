// Shortens edges that are stretched too far: the simplest of the constraints of collide/close.

const STRETCH = 1.15, SWEEPS = 4;

export class EdgeLimits {
  /** Takes edges (edges, 2), their largest lengths by the pattern [m], and which vertices are free. */
  constructor(edges, longest, free) {
    Object.assign(this, { edges, longest, free });
    this.listed = new Int32Array(longest.length);
    this.limits = new Float32Array(longest.length);
  }

  /** Shortens edges that are too long for the pattern and for the garment at rest on the body. */
  limit(vertices, rest) {
    const { edges, longest, free, listed, limits } = this;
    let count = 0;
    for (let e = 0; e < longest.length; e++) {
      const a = 3 * edges[2 * e], b = 3 * edges[2 * e + 1], most = longest[e];
      const x = vertices[b] - vertices[a], y = vertices[b + 1] - vertices[a + 1], z = vertices[b + 2] - vertices[a + 2];
      if (x * x + y * y + z * z > most * most) listed[count++] = e;
    }
    for (let k = 0; k < count; k++) {
      const a = 3 * edges[2 * listed[k]], b = 3 * edges[2 * listed[k] + 1];
      const x = rest[b] - rest[a], y = rest[b + 1] - rest[a + 1], z = rest[b + 2] - rest[a + 2];
      limits[k] = Math.max(longest[listed[k]], STRETCH * Math.sqrt(x * x + y * y + z * z));
    }
    for (let sweep = 0; sweep < SWEEPS; sweep++) {
      for (let turn = 0; turn < count; turn++) {
        const k = sweep % 2 === 0 ? turn : count - 1 - turn;
        const one = edges[2 * listed[k]], other = edges[2 * listed[k] + 1], a = 3 * one, b = 3 * other;
        const x = vertices[b] - vertices[a], y = vertices[b + 1] - vertices[a + 1], z = vertices[b + 2] - vertices[a + 2];
        const length = Math.sqrt(x * x + y * y + z * z);
        if (length <= limits[k]) continue;
        const pull = (length - limits[k]) / (length * Math.max(free[one] + free[other], 1));
        const forA = pull * free[one], forB = pull * free[other];
        vertices[a] += forA * x;
        vertices[a + 1] += forA * y;
        vertices[a + 2] += forA * z;
        vertices[b] -= forB * x;
        vertices[b + 1] -= forB * y;
        vertices[b + 2] -= forB * z;
      }
    }
  }
}
