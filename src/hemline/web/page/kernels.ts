// AssemblyScript: the heavy part of a frame, with 128-bit vectors; all pointers are into the memory of the page.
// `python -m hemline.web.build` compiles it to kernels.wasm. Arguments: inputs first, then outputs.

// Computes sums over columns of 8-bit digits times 16-bit weights, exact in 32 bits.
// model: digits (blocks, pairs, 32 rows, 2 columns) int8   in: weights (pairs, 2) int16   out: sums (32 blocks) int32
export function products(digits: usize, weights: usize, blocks: i32, pairs: i32, sums: usize): void {
  for (let block = 0; block < blocks; block++) {
    let a = i32x4.splat(0), b = a, c = a, d = a, e = a, f = a, g = a, h = a;
    let weight = weights;
    for (let pair = 0; pair < pairs; pair++) {
      const both = v128.load32_splat(weight);
      const first = v128.load(digits), second = v128.load(digits, 16);
      const third = v128.load(digits, 32), fourth = v128.load(digits, 48);
      a = i32x4.add(a, i32x4.dot_i16x8_s(i16x8.extend_low_i8x16_s(first), both));
      b = i32x4.add(b, i32x4.dot_i16x8_s(i16x8.extend_high_i8x16_s(first), both));
      c = i32x4.add(c, i32x4.dot_i16x8_s(i16x8.extend_low_i8x16_s(second), both));
      d = i32x4.add(d, i32x4.dot_i16x8_s(i16x8.extend_high_i8x16_s(second), both));
      e = i32x4.add(e, i32x4.dot_i16x8_s(i16x8.extend_low_i8x16_s(third), both));
      f = i32x4.add(f, i32x4.dot_i16x8_s(i16x8.extend_high_i8x16_s(third), both));
      g = i32x4.add(g, i32x4.dot_i16x8_s(i16x8.extend_low_i8x16_s(fourth), both));
      h = i32x4.add(h, i32x4.dot_i16x8_s(i16x8.extend_high_i8x16_s(fourth), both));
      weight += 4;
      digits += 64;
    }
    v128.store(sums, a);
    v128.store(sums, b, 16);
    v128.store(sums, c, 32);
    v128.store(sums, d, 48);
    v128.store(sums, e, 64);
    v128.store(sums, f, 80);
    v128.store(sums, g, 96);
    v128.store(sums, h, 112);
    sums += 128;
  }
}

// in: sums (3 count) int32, unit [m], rest (count, 3), columns (4, 4) of R | t, padded by zeros
// out: vertices (count, 3) and one extra number: R (rest + unit sums) + t
export function place(sums: usize, unit: f32, rest: usize, columns: usize, count: i32, vertices: usize): void {
  const c0 = v128.load(columns), c1 = v128.load(columns, 16), c2 = v128.load(columns, 32), c3 = v128.load(columns, 48);
  for (let i = 0; i < count; i++) {
    const x = load<f32>(rest) + <f32>load<i32>(sums) * unit;
    const y = load<f32>(rest, 4) + <f32>load<i32>(sums, 4) * unit;
    const z = load<f32>(rest, 8) + <f32>load<i32>(sums, 8) * unit;
    v128.store(vertices, f32x4.add(moved(c0, c1, c2, x, y, z), c3));
    sums += 12;
    rest += 12;
    vertices += 12;
  }
}

// Computes one layer of a network; inputs that are zero are skipped.
// model: weights (tiles, ins, 16), biases (16 tiles)   in: inputs (ins); live (2 ins): scratch for inputs that are not zero
// out: outputs (16 tiles), rectified if `rectified`
export function layer(
  weights: usize, biases: usize, inputs: usize, ins: i32, tiles: i32, rectified: i32, live: usize, outputs: usize,
): void {
  let end = live;
  for (let j = 0; j < ins; j++) {
    const input = load<f32>(inputs + 4 * j);
    if (input != 0) {
      store<i32>(end, 64 * j);
      store<f32>(end, input, 4);
      end += 8;
    }
  }
  const zero = f32x4.splat(0);
  for (let tile = 0; tile < tiles; tile++) {
    let a = v128.load(biases), b = v128.load(biases, 16), c = v128.load(biases, 32), d = v128.load(biases, 48);
    for (let each = live; each < end; each += 8) {
      const row = weights + load<i32>(each), factor = v128.load32_splat(each, 4);
      a = f32x4.add(a, f32x4.mul(factor, v128.load(row)));
      b = f32x4.add(b, f32x4.mul(factor, v128.load(row, 16)));
      c = f32x4.add(c, f32x4.mul(factor, v128.load(row, 32)));
      d = f32x4.add(d, f32x4.mul(factor, v128.load(row, 48)));
    }
    if (rectified) {
      a = f32x4.max(a, zero);
      b = f32x4.max(b, zero);
      c = f32x4.max(c, zero);
      d = f32x4.max(d, zero);
    }
    v128.store(outputs, a);
    v128.store(outputs, b, 16);
    v128.store(outputs, c, 32);
    v128.store(outputs, d, 48);
    weights += 64 * ins;
    biases += 64;
    outputs += 64;
  }
}

// Skins points and their normals by linear blending.
// model: bones (count, 6) uint8, weights (count, 6), zeros last   in: columns (joints, 4, 4), points, normals (count, 3)
// out: points and unit normals, each (count, 3) and one extra number
export function skin(
  bones: usize, weights: usize, columns: usize, points: usize, normals: usize, count: i32, posed: usize, turned: usize,
): void {
  for (let i = 0; i < count; i++) {
    let m0 = f32x4.splat(0), m1 = m0, m2 = m0, m3 = m0;
    for (let k = 0; k < 6; k++) {
      const weight = load<f32>(weights + 4 * k);
      if (weight == 0) break;
      const factor = f32x4.splat(weight), column = columns + 64 * <usize>load<u8>(bones + k);
      m0 = f32x4.add(m0, f32x4.mul(factor, v128.load(column)));
      m1 = f32x4.add(m1, f32x4.mul(factor, v128.load(column, 16)));
      m2 = f32x4.add(m2, f32x4.mul(factor, v128.load(column, 32)));
      m3 = f32x4.add(m3, f32x4.mul(factor, v128.load(column, 48)));
    }
    const at = moved(m0, m1, m2, load<f32>(points), load<f32>(points, 4), load<f32>(points, 8));
    v128.store(posed, f32x4.add(at, m3));
    const up = moved(m0, m1, m2, load<f32>(normals), load<f32>(normals, 4), load<f32>(normals, 8));
    v128.store(turned, f32x4.mul(up, f32x4.splat(<f32>1 / sqrt<f32>(max<f32>(dot(up, up), 1e-30)))));
    bones += 6;
    weights += 24;
    points += 12;
    normals += 12;
    posed += 12;
    turned += 12;
  }
}

// Computes area-weighted normals of a mesh.
// model: faces (faceCount, 3) uint32   in: vertices (count, 3)   out: normals (count, 3) and one extra number
export function areaNormals(faces: usize, vertices: usize, faceCount: i32, count: i32, normals: usize): void {
  memory.fill(normals, 0, 12 * count + 4);
  for (let f = 0; f < faceCount; f++) {
    const i = 12 * load<u32>(faces), j = 12 * load<u32>(faces, 4), k = 12 * load<u32>(faces, 8);
    const x = load<f32>(vertices + i), y = load<f32>(vertices + i, 4), z = load<f32>(vertices + i, 8);
    const ux = load<f32>(vertices + j) - x, uy = load<f32>(vertices + j, 4) - y, uz = load<f32>(vertices + j, 8) - z;
    const vx = load<f32>(vertices + k) - x, vy = load<f32>(vertices + k, 4) - y, vz = load<f32>(vertices + k, 8) - z;
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    add(normals + i, nx, ny, nz);
    add(normals + j, nx, ny, nz);
    add(normals + k, nx, ny, nz);
    faces += 12;
  }
  for (let i = 0; i < count; i++) {
    const x = load<f32>(normals), y = load<f32>(normals, 4), z = load<f32>(normals, 8);
    const scale = <f32>1 / sqrt<f32>(max<f32>(x * x + y * y + z * z, 1e-30));
    store<f32>(normals, x * scale);
    store<f32>(normals, y * scale, 4);
    store<f32>(normals, z * scale, 8);
    normals += 12;
  }
}

// Computes a close-fitting garment in a pose, as the dressing kernel of `animators/agentdress` does.
// model: bones uint8, weights (count, 6), the largest first; regions (count, regionCount); digits (count, 3, columns)
//     int8, columns a multiple of 16   in: mixed (regionCount, columns) [m]; rest, offset (count, 3) [m]; columns of the
//     transforms (joints, 4, 4); quaternions (joints, 4); columnWeights (columns): scratch   out: vertices (count, 3) [m]
export function wear(
  bones: usize, weights: usize, regions: usize, regionCount: i32, digits: usize, columns: i32, mixed: usize,
  rest: usize, offset: usize, transforms: usize, quaternions: usize, columnWeights: usize, count: i32, vertices: usize,
): void {
  for (let i = 0; i < count; i++) {
    memory.fill(columnWeights, 0, 4 * columns);
    for (let g = 0; g < regionCount; g++) {
      const region = load<f32>(regions + 4 * g);
      if (region > 1e-4) {
        const factor = f32x4.splat(region), row = mixed + 4 * g * columns;
        for (let k = 0; k < 4 * columns; k += 16) {
          v128.store(columnWeights + k, f32x4.add(v128.load(columnWeights + k), f32x4.mul(factor, v128.load(row + k))));
        }
      }
    }
    const ux = load<f32>(offset) + weightedDigits(digits, columnWeights, columns);
    const uy = load<f32>(offset, 4) + weightedDigits(digits + columns, columnWeights, columns);
    const uz = load<f32>(offset, 8) + weightedDigits(digits + 2 * columns, columnWeights, columns);
    let at = f32x4.splat(0), q = f32x4.splat(0);
    const first = v128.load(quaternions + 16 * <usize>load<u8>(bones));
    const x = load<f32>(rest), y = load<f32>(rest, 4), z = load<f32>(rest, 8);
    for (let k = 0; k < 6; k++) {
      const weight = load<f32>(weights + 4 * k);
      if (weight == 0) break;
      const bone = <usize>load<u8>(bones + k), column = transforms + 64 * bone;
      const here = moved(v128.load(column), v128.load(column, 16), v128.load(column, 32), x, y, z);
      at = f32x4.add(at, f32x4.mul(f32x4.splat(weight), f32x4.add(here, v128.load(column, 48))));
      const turn = v128.load(quaternions + 16 * bone);
      q = f32x4.add(q, f32x4.mul(f32x4.splat(dot(first, turn) < 0 ? -weight : weight), turn));
    }
    q = f32x4.mul(q, f32x4.splat(<f32>1 / sqrt<f32>(dot(q, q))));
    const a = f32x4.extract_lane(q, 0), b = f32x4.extract_lane(q, 1);
    const c = f32x4.extract_lane(q, 2), d = f32x4.extract_lane(q, 3);
    const u = turned(a, b, c, d, ux, uy, uz);
    at = f32x4.add(at, u);
    store<f32>(vertices, f32x4.extract_lane(at, 0));
    store<f32>(vertices, f32x4.extract_lane(at, 1), 4);
    store<f32>(vertices, f32x4.extract_lane(at, 2), 8);
    bones += 6;
    weights += 24;
    regions += 4 * regionCount;
    digits += 3 * columns;
    rest += 12;
    offset += 12;
    vertices += 12;
  }
}

// Pushes vertices out of the body, from the closest point on the triangles around the nearest vertex of the skin. The
// search starts at its previous result, and at that of the previous vertex of the garment.
// model: starts (skinCount + 1), around (.., 2) uint32: the two other corners of each triangle at a vertex of the skin;
//     samples (sampleCount) uint32: vertices from which a part of the garment searches anew: that of `turn`
//     out of 32, or all of it where `turn` is negative
// in: skin, normals (skinCount, 3); gap: distance to keep; deepest: deeper vertices are not moved [m]
// in/out: nearest (count) uint32, vertices (count, 3)
export function push(
  starts: usize, around: usize, samples: usize, sampleCount: i32, turn: i32, skin: usize, normals: usize, gap: f32,
  deepest: f32, count: i32, nearest: usize, vertices: usize,
): void {
  const far = (deepest + LONGEST_EDGE) * (deepest + LONGEST_EDGE);
  let best: u32 = load<u32>(nearest);
  for (let i = 0; i < count; i++) {
    const x = load<f32>(vertices), y = load<f32>(vertices, 4), z = load<f32>(vertices, 8);
    const own = load<u32>(nearest), ownAway = squared(skin, own, x, y, z);
    let least = squared(skin, best, x, y, z);
    if (ownAway <= least) {
      least = ownAway;
      best = own;
    }
    if (turn < 0 || (i & 31) == turn) {
      for (let s = 0; s < sampleCount; s++) {
        const other = load<u32>(samples + 4 * s), there = squared(skin, other, x, y, z);
        if (there < least) {
          least = there;
          best = other;
        }
      }
    }
    for (let before: u32 = 0xffffffff; before != best; ) {
      before = best;
      const end = load<u32>(starts + 4 * best, 4);
      for (let at = load<u32>(starts + 4 * best); at < end; at++) {
        const other = load<u32>(around + 8 * at), there = squared(skin, other, x, y, z);
        if (there < least) {
          least = there;
          best = other;
        }
      }
    }
    store<u32>(nearest, best);
    if (least < far) pushFrom(best, starts, around, skin, normals, gap, deepest, vertices);
    nearest += 4;
    vertices += 12;
  }
}

const LONGEST_EDGE: f32 = 0.06; // of the skin, about [m]
const OUTSIDE: f32 = 0.03; // so far over the nearest vertex nothing is inside [m]
let second: f32 = 0, third: f32 = 0; // weights of the corners of a triangle at the point that `closest` found

function pushFrom(
  best: u32, starts: usize, around: usize, skin: usize, normals: usize, gap: f32, deepest: f32, vertex: usize,
): void {
  const p = v128.load(vertex), corner = v128.load(skin + 12 * best), end = load<u32>(starts + 4 * best, 4);
  let least: f32 = 1e9, place = corner, up = v128.load(normals + 12 * best);
  if (dot3(f32x4.sub(p, corner), up) > OUTSIDE) return;
  for (let at = load<u32>(starts + 4 * best); at < end; at++) {
    const one = load<u32>(around + 8 * at), other = load<u32>(around + 8 * at, 4);
    const b = f32x4.sub(v128.load(skin + 12 * one), corner), c = f32x4.sub(v128.load(skin + 12 * other), corner);
    closest(f32x4.sub(p, corner), b, c);
    const there = f32x4.add(corner, f32x4.add(f32x4.mul(b, f32x4.splat(second)), f32x4.mul(c, f32x4.splat(third))));
    const apart = f32x4.sub(p, there), away = dot3(apart, apart);
    if (away < least) {
      least = away;
      place = there;
      const first = f32x4.mul(v128.load(normals + 12 * best), f32x4.splat(<f32>1 - second - third));
      const rest = f32x4.mul(v128.load(normals + 12 * one), f32x4.splat(second));
      up = f32x4.add(first, f32x4.add(rest, f32x4.mul(v128.load(normals + 12 * other), f32x4.splat(third))));
    }
  }
  if (least > deepest * deepest) return;
  up = f32x4.mul(up, f32x4.splat(<f32>1 / sqrt<f32>(max<f32>(dot3(up, up), 1e-30))));
  const lack = gap - dot3(f32x4.sub(p, place), up);
  if (lack <= 0) return;
  add(vertex, lack * f32x4.extract_lane(up, 0), lack * f32x4.extract_lane(up, 1), lack * f32x4.extract_lane(up, 2));
}

// Finds the point on a triangle 0, b, c closest to p: b `second` + c `third` (Ericson, Real-Time Collision Detection, 5.1.5).
function closest(p: v128, b: v128, c: v128): void {
  const d1 = dot3(b, p), d2 = dot3(c, p), bb = dot3(b, b), bc = dot3(b, c), cc = dot3(c, c);
  const d3 = d1 - bb, d4 = d2 - bc, d5 = d1 - bc, d6 = d2 - cc;
  const va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  second = 0;
  third = 0;
  if (d1 <= 0 && d2 <= 0) return;
  if (d3 >= 0 && d4 <= d3) {
    second = 1;
  } else if (vc <= 0 && d1 >= 0 && d3 <= 0) {
    second = d1 / (d1 - d3);
  } else if (d6 >= 0 && d5 <= d6) {
    third = 1;
  } else if (vb <= 0 && d2 >= 0 && d6 <= 0) {
    third = d2 / (d2 - d6);
  } else if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    third = (d4 - d3) / (d4 - d3 + d5 - d6);
    second = <f32>1 - third;
  } else {
    const whole = <f32>1 / (va + vb + vc);
    second = vb * whole;
    third = vc * whole;
  }
}

// in: values (count), factor   in/out: totals (count), and up to three extra numbers: totals + factor values
export function addScaled(values: usize, factor: f32, count: i32, totals: usize): void {
  const all = f32x4.splat(factor);
  for (let k = 0; k < 4 * count; k += 16) {
    v128.store(totals + k, f32x4.add(v128.load(totals + k), f32x4.mul(all, v128.load(values + k))));
  }
}

// @ts-ignore: decorator
@inline
function moved(c0: v128, c1: v128, c2: v128, x: f32, y: f32, z: f32): v128 {
  const plane = f32x4.add(f32x4.mul(c0, f32x4.splat(x)), f32x4.mul(c1, f32x4.splat(y)));
  return f32x4.add(plane, f32x4.mul(c2, f32x4.splat(z)));
}

// Rotates a vector u by (a, q), q = (b, c, d): u + 2 a (q x u) + 2 q x (q x u).
// @ts-ignore: decorator
@inline
function turned(a: f32, b: f32, c: f32, d: f32, ux: f32, uy: f32, uz: f32): v128 {
  const two: f32 = 2;
  const ex = two * (c * uz - d * uy), ey = two * (d * ux - b * uz), ez = two * (b * uy - c * ux);
  return f32x4(ux + a * ex + c * ez - d * ey, uy + a * ey + d * ex - b * ez, uz + a * ez + b * ey - c * ex, 0);
}

// @ts-ignore: decorator
@inline
function dot(one: v128, other: v128): f32 {
  const each = f32x4.mul(one, other);
  const front = f32x4.extract_lane(each, 0) + f32x4.extract_lane(each, 1);
  return front + f32x4.extract_lane(each, 2) + f32x4.extract_lane(each, 3);
}

// @ts-ignore: decorator
@inline
function dot3(one: v128, other: v128): f32 {
  const each = f32x4.mul(one, other);
  return f32x4.extract_lane(each, 0) + f32x4.extract_lane(each, 1) + f32x4.extract_lane(each, 2);
}

// @ts-ignore: decorator
@inline
function add(at: usize, x: f32, y: f32, z: f32): void {
  store<f32>(at, load<f32>(at) + x);
  store<f32>(at, load<f32>(at, 4) + y, 4);
  store<f32>(at, load<f32>(at, 8) + z, 8);
}

// @ts-ignore: decorator
@inline
function squared(points: usize, i: u32, x: f32, y: f32, z: f32): f32 {
  const at = points + 12 * i, a = load<f32>(at) - x, b = load<f32>(at, 4) - y, c = load<f32>(at, 8) - z;
  return a * a + b * b + c * c;
}

// @ts-ignore: decorator
@inline
function weightedDigits(digits: usize, columnWeights: usize, columns: i32): f32 {
  let total = f32x4.splat(0);
  for (let k = 0; k < columns; k += 16) {
    const some = v128.load(digits + k), factor = columnWeights + 4 * k;
    const low = i16x8.extend_low_i8x16_s(some), high = i16x8.extend_high_i8x16_s(some);
    const a = f32x4.convert_i32x4_s(i32x4.extend_low_i16x8_s(low));
    const b = f32x4.convert_i32x4_s(i32x4.extend_high_i16x8_s(low));
    const c = f32x4.convert_i32x4_s(i32x4.extend_low_i16x8_s(high));
    const d = f32x4.convert_i32x4_s(i32x4.extend_high_i16x8_s(high));
    total = f32x4.add(total, f32x4.mul(a, v128.load(factor)));
    total = f32x4.add(total, f32x4.mul(b, v128.load(factor, 16)));
    total = f32x4.add(total, f32x4.mul(c, v128.load(factor, 32)));
    total = f32x4.add(total, f32x4.mul(d, v128.load(factor, 48)));
  }
  return dot(total, f32x4.splat(1));
}
