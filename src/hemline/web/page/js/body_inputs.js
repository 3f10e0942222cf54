// The body's motion around the key joint, in numbers; animators/ropes/bones/body_inputs, body_input_kernels.

import { point, toWorld } from "hemline/joint_frames.js";

const UNUSED_JOINTS = [10, 11, 12, 15, 22, 23]; // feet, neck, head, hands
const INPUT_JOINTS = Array.from({ length: 24 }, (_, joint) => joint).filter((joint) => !UNUSED_JOINTS.includes(joint));
/** Inputs from a body that stands still: gravity points down. */
export const REST_INPUTS = new Float64Array(6 + 3 * INPUT_JOINTS.length);
REST_INPUTS[1] = -1;

/** Returns the inputs of the bone correction from two poses `dt` apart [s], with the velocity relative to the air. */
export function bodyInputs(then, now, dt, { key, pivots, constants }) {
  const inputs = new Float64Array(REST_INPUTS.length), f = 12 * key;
  const there = placeOf(then, key, pivots), here = placeOf(now, key, pivots);
  for (let a = 0; a < 3; a++) {
    inputs[a] = -now[f + 4 + a];
    for (let c = 0; c < 3; c++) inputs[3 + a] += now[f + 4 * c + a] * ((here[c] - there[c]) / dt - constants.wind[c]);
  }
  INPUT_JOINTS.forEach((joint, k) => {
    const place = placeOf(now, joint, pivots);
    for (let a = 0; a < 3; a++) {
      let sum = 0;
      for (let c = 0; c < 3; c++) sum += (place[c] - now[f + 4 * c + 3]) * now[f + 4 * c + a];
      inputs[6 + 3 * k + a] = sum - pivots[3 * joint + a];
    }
  });
  return inputs;
}

function placeOf(frames, joint, pivots) {
  toWorld(frames, joint, pivots[3 * joint], pivots[3 * joint + 1], pivots[3 * joint + 2]);
  return [...point];
}
