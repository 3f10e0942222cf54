// Linear correction of the ropes' bones; animators/ropes/bones/bone_correction.

import { bodyInputs, REST_INPUTS } from "hemline/body_inputs.js";

export class BoneCorrection {
  constructor({ modes, matrix, outputs, low, high, swing_gain: [swingGain] }, chains) {
    Object.assign(this, { modes, matrix, outputs, low, high, swingGain, chains });
    [this.count, this.rows] = modes.shape;
  }

  /** Returns the change of the displacements, between two poses `dt` apart [s]. */
  change(moved, then, now, dt) {
    const { modes, matrix, outputs, low, high, count, rows } = this, out = new Float64Array(rows);
    const seen = bodyInputs(then, now, dt, this.chains), ins = count + seen.length, inputs = new Float64Array(ins);
    for (let k = 0, m = 0; k < count; k++) for (let n = 0; n < rows; n++, m++) inputs[k] += modes[m] * moved[n];
    seen.forEach((value, i) => (inputs[count + i] = Math.min(Math.max(value, low[i]), high[i]) - REST_INPUTS[i]));
    for (let k = 0; ins * k < matrix.length; k++) {
      let coefficient = 0;
      for (let i = 0, m = k * ins; i < ins; i++, m++) coefficient += matrix[m] * inputs[i];
      for (let n = 0, m = k * rows; n < rows; n++, m++) out[n] += coefficient * outputs[m];
    }
    return out;
  }
}
