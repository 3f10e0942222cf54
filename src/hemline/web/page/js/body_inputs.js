// The body's motion around the key joint, in numbers; animators/ropes/bones/body_inputs, body_input_kernels.

import { point, toWorld } from "hemline/joint_frames.js";

const UNUSED_JOINTS = [10, 11, 12, 15, 22, 23]; // feet, neck, head, hands
const INPUT_JOINTS = Array.from({ length: 24 }, (_, joint) => joint).filter((joint) => !UNUSED_JOINTS.includes(joint));
const VELOCITY = 3, JOINTS = 15;
export const COUNT = 15 + 6 * INPUT_JOINTS.length;
const JOINTS_END = JOINTS + 3 * INPUT_JOINTS.length;
/** Inputs of the bone correction from a body that stands still: gravity points down. */
export const REST_INPUTS = new Float64Array(6 + JOINTS_END - JOINTS);
REST_INPUTS[1] = -1;

/** Writes the inputs of the learned bones from three poses, `dtBefore` and `dt` apart [s]. */
export function bodyInputs(before, then, now, dtBefore, dt, { key, pivots }, inputs) {
  const f = 12 * key;
  const places = [before, then, now].map((frames) => jointsOn(frames, pivots));
  const spins = [spinBetween(before, then, f), spinBetween(then, now, f)];
  for (let a = 0; a < 3; a++) {
    let speed = 0, change = 0;
    for (let c = 0; c < 3; c++) {
      const velocity = (places[2][3 * key + c] - places[1][3 * key + c]) / dt;
      const earlier = (places[1][3 * key + c] - places[0][3 * key + c]) / dtBefore;
      speed += now[f + 4 * c + a] * velocity;
      change += now[f + 4 * c + a] * (velocity - earlier);
    }
    inputs[a] = -now[f + 4 + a];
    inputs[3 + a] = speed, inputs[6 + a] = change;
    inputs[9 + a] = spins[1][a] / dt;
    inputs[12 + a] = spins[1][a] / dt - spins[0][a] / dtBefore;
  }
  INPUT_JOINTS.forEach((joint, k) => {
    for (let a = 0; a < 3; a++) {
      let here = 0, there = 0;
      for (let c = 0; c < 3; c++) {
        here += (places[2][3 * joint + c] - now[f + 4 * c + 3]) * now[f + 4 * c + a];
        there += (places[1][3 * joint + c] - then[f + 4 * c + 3]) * then[f + 4 * c + a];
      }
      inputs[15 + 3 * k + a] = here - pivots[3 * joint + a];
      inputs[15 + 3 * (INPUT_JOINTS.length + k) + a] = (here - there) / dt;
    }
  });
}

/** Returns the inputs of the bone correction from two poses `dt` apart [s], with velocities relative to the air. */
export function correctionInputs(then, now, dt, chains) {
  const all = new Float64Array(COUNT), f = 12 * chains.key, { wind } = chains.constants;
  bodyInputs(then, then, now, dt, dt, chains, all);
  for (let a = 0; a < 3; a++) for (let c = 0; c < 3; c++) all[VELOCITY + a] -= now[f + 4 * c + a] * wind[c];
  return Float64Array.of(...all.subarray(0, 6), ...all.subarray(JOINTS, JOINTS_END));
}

/** Returns the joints on a posed body. */
export function jointsOn(frames, pivots) {
  const places = new Float64Array(pivots.length);
  for (let j = 0; 3 * j < pivots.length; j++) {
    toWorld(frames, j, pivots[3 * j], pivots[3 * j + 1], pivots[3 * j + 2]);
    places.set(point, 3 * j);
  }
  return places;
}

/** Returns the sines of the rotation of a joint between two poses, in its own frame. */
function spinBetween(before, now, f) {
  const entry = (a, b) => {
    let sum = 0;
    for (let c = 0; c < 3; c++) sum += before[f + 4 * c + a] * now[f + 4 * c + b];
    return sum;
  };
  return [[2, 1], [0, 2], [1, 0]].map(([a, b]) => 0.5 * (entry(a, b) - entry(b, a)));
}
