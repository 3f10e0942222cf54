// Small networks and packed bases; `hemline.learning.mlp` and `packed_basis`.

import { intoColumns } from "hemline/kernels.js";

const TILE = 16, ROWS = 32;

/** y = W3 relu(W2 relu(W1 x + b1) + b2) + b3, or with one layer y = W1 x + b1. */
export class Mlp {
  constructor(arrays, kernels) {
    this.kernels = kernels;
    this.layers = (arrays.weight1 ? [0, 1, 2] : [0]).map((i) => {
      const weights = arrays[`weight${i}`], [outs, ins] = weights.shape, tiles = Math.ceil(outs / TILE);
      const packed = kernels.floats(tiles * ins * TILE), biases = kernels.floats(tiles * TILE);
      biases.set(arrays[`bias${i}`]);
      for (let out = 0; out < outs; out++) {
        const first = Math.floor(out / TILE) * ins * TILE + (out % TILE);
        for (let j = 0; j < ins; j++) packed[first + TILE * j] = weights[ins * out + j];
      }
      return { packed, biases, ins, outs, tiles, outputs: kernels.floats(tiles * TILE) };
    });
    this.inputs = kernels.floats(this.layers[0].ins);
    this.live = kernels.words(2 * Math.max(...this.layers.map(({ ins }) => ins)));
  }

  /** Returns the output for one input; the next call overwrites it. */
  run(inputs) {
    this.inputs.set(inputs);
    let value = this.inputs;
    this.layers.forEach(({ packed, biases, ins, tiles, outputs }, i) => {
      const rectified = i < this.layers.length - 1 ? 1 : 0;
      this.kernels.layer(
        packed.byteOffset, biases.byteOffset, value.byteOffset, ins, tiles, rectified, this.live.byteOffset,
        outputs.byteOffset,
      );
      value = outputs;
    });
    return value.subarray(0, this.layers.at(-1).outs);
  }
}

/** Computes vertices from coefficients of 8-bit bases. */
export class PackedBasis {
  /** `bases` is a list of arrays, each with `digits` (columns, 3, verts), differences along the vertices. */
  constructor(bases, kernels) {
    this.kernels = kernels;
    this.count = bases[0].digits.shape[2];
    this.columns = bases.reduce((sum, { scales }) => sum + scales.length, 0);
    this.pairs = Math.ceil(this.columns / 2);
    this.blocks = Math.ceil((3 * this.count) / ROWS);
    this.scales = new Float32Array(2 * this.pairs);
    this.modes = new Int32Array(2 * this.pairs);
    this.digits = kernels.bytes(this.blocks * this.pairs * 2 * ROWS);
    this.sums = kernels.words(this.blocks * ROWS);
    this.weights = kernels.halves(2 * this.pairs);
    this.transform = kernels.floats(16);
    let column = 0, mode = 0;
    for (const { digits, scales, modes } of bases) {
      this.scales.set(scales, column);
      this.modes.set(modes.map((each) => each + mode), column);
      this.#unpack(digits, column);
      column += scales.length, mode += Math.max(...modes) + 1;
    }
  }

  #unpack(digits, column) {
    for (let from = 0; from < digits.length; column++) {
      for (let c = 0; c < 3; c++) {
        for (let v = 0, value = 0; v < this.count; v++, from++) {
          value = ((value + digits[from]) << 24) >> 24;
          const row = 3 * v + c, place = Math.floor(row / ROWS) * this.pairs + (column >> 1);
          this.digits[2 * ROWS * place + 2 * (row % ROWS) + (column & 1)] = value;
        }
      }
    }
  }

  /** Writes R (rest + B c) + t into `vertices`, with the transform of a joint. */
  place(coefficients, rest, transforms, joint, vertices) {
    const wanted = this.scales.map((scale, k) => coefficients[this.modes[k]] * scale);
    const largest = wanted.reduce((most, each) => Math.max(most, Math.abs(each)), 0);
    const unit = largest > 0 ? Math.fround(largest / 32767) : 1;
    wanted.forEach((each, k) => (this.weights[k] = roundHalfToEven(Math.fround(each / unit))));
    const { digits, weights, blocks, pairs, sums, transform, count } = this;
    this.kernels.products(digits.byteOffset, weights.byteOffset, blocks, pairs, sums.byteOffset);
    intoColumns(transforms.subarray(12 * joint, 12 * joint + 12), transform);
    const pointers = [rest, transform, vertices].map(({ byteOffset }) => byteOffset);
    this.kernels.place(sums.byteOffset, unit, pointers[0], pointers[1], count, pointers[2]);
  }
}

/** Rounds to the nearest whole number, halves to the even one. */
function roundHalfToEven(value) {
  const below = Math.floor(value), apart = value - below;
  if (apart !== 0.5) return apart < 0.5 ? below : below + 1;
  return below % 2 === 0 ? below : below + 1;
}
