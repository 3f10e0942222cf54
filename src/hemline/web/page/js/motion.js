// Clips: placement on a body, poses at any time, and the run-up; see `hemline.motions`, `bodies/place`, `bodies/lead_in`.

import { at, multiply, slerp } from "hemline/quaternions.js";
import { JOINTS } from "hemline/body.js";

const CONTACT_PERCENT = 5, SOLE_HEIGHT = 0.03, FASTEST_START = 8;
const FEET = [7, 8, 10, 11]; // ankles and feet

export class Clip {
  constructor(arrays, { fps, leg_length: legLength }) {
    Object.assign(this, { rotations: arrays.rotations, read: arrays.translations, fps, legLength });
    this.count = this.read.length / 3;
    this.seconds = (this.count - 1) / fps;
  }

  /** Scales the translations to the legs of a body, and puts its soles on the floor. */
  place(body) {
    const scale = Math.fround(body.legLength / this.legLength);
    this.translations = this.read.map((value) => Math.fround(value) * scale);
    const lift = -percentile(this.#soleHeights(body), CONTACT_PERCENT);
    this.translations = this.translations.map((value, i) => (i % 3 === 1 ? value + Math.fround(lift) : value));
  }

  /** Returns the pose of a frame. */
  frame(index) {
    return {
      rotations: this.rotations.subarray(4 * JOINTS * index, 4 * JOINTS * (index + 1)),
      translation: this.translations.subarray(3 * index, 3 * index + 3),
    };
  }

  /** Returns the pose at a time [s], clamped to the clip. */
  at(seconds) {
    const place = Math.min(Math.max(seconds * this.fps, 0), this.count - 1);
    const before = Math.floor(place);
    return between(this.frame(before), this.frame(Math.min(before + 1, this.count - 1)), place - before);
  }

  #soleHeights(body) {
    const soles = soleVertices(body);
    return Array.from({ length: this.count }, (_, index) => {
      body.pose(this.frame(index));
      body.bend();
      return soles.reduce((lowest, vertex) => Math.min(lowest, heightOf(body, vertex)), Infinity);
    });
  }
}

/** Returns the run-up to the speed of a clip's start: poses from the rest pose to the first pose. */
export function runUp(body, first, second, frames, dt) {
  if (frames < 1) return [first];
  const velocity = second ? [0, 1, 2].map((c) => (second.translation[c] - first.translation[c]) / dt) : [0, 0, 0];
  velocity[1] = 0;
  const slower = Math.min(1, FASTEST_START / Math.max(Math.hypot(...velocity), 1e-9));
  const total = frames * dt, start = stance(body, first, velocity.map((each) => -0.5 * total * slower * each));
  const poses = Array.from({ length: frames }, (_, frame) => {
    const fraction = frame / frames, { rotations } = between(start, first, fraction * fraction * (3 - 2 * fraction));
    const translation = start.translation.map((place, c) => place + 0.5 * slower * velocity[c] * total * fraction ** 2);
    return { rotations, translation };
  });
  return [...poses, first];
}

/** Interpolates two poses, each joint by slerp. */
export function between(first, second, fraction) {
  if (fraction <= 0) return first;
  if (fraction >= 1) return second;
  const rotations = new Float32Array(4 * JOINTS);
  for (let joint = 0; joint < JOINTS; joint++) {
    rotations.set(slerp(at(first.rotations, joint), at(second.rotations, joint), fraction), 4 * joint);
  }
  const translation = first.translation.map((start, c) => start + fraction * (second.translation[c] - start));
  return { rotations, translation };
}

/** Returns the rest pose with the heading of the first pose, at an offset from it [m]. */
function stance(body, first, offset) {
  body.pose(first);
  const m = body.transforms, yaw = Math.atan2(m[2] - m[8], m[0] + m[10]), rest = body.restPose();
  rest.rotations.set(multiply([Math.cos(yaw / 2), 0, Math.sin(yaw / 2), 0], at(rest.rotations, 0)));
  return { rotations: rest.rotations, translation: first.translation.map((place, c) => place + offset[c]) };
}

/** Returns the vertices of both soles: those of ankles and feet in the lowest 3 cm of the body at rest. */
function soleVertices(body) {
  const onFeet = [];
  for (let i = 0; i < body.count; i++) {
    let fraction = 0;
    for (let k = 6 * i; k < 6 * i + 6; k++) if (FEET.includes(body.bones[k])) fraction += body.weights[k];
    if (fraction > 0.99) onFeet.push(i);
  }
  const lowest = onFeet.reduce((low, i) => Math.min(low, body.rest[3 * i + 1]), Infinity);
  return onFeet.filter((i) => body.rest[3 * i + 1] < Math.fround(lowest + SOLE_HEIGHT));
}

function heightOf(body, vertex) {
  const t = body.transforms, [x, y, z] = body.moved.subarray(3 * vertex, 3 * vertex + 3);
  let height = 0;
  for (let k = 6 * vertex; k < 6 * vertex + 6 && body.weights[k] !== 0; k++) {
    const row = 12 * body.bones[k] + 4;
    height += body.weights[k] * (t[row] * x + t[row + 1] * y + t[row + 2] * z + t[row + 3]);
  }
  return Math.fround(height);
}

function percentile(values, percent) {
  const sorted = [...values].sort((one, other) => one - other), place = (percent / 100) * (sorted.length - 1);
  const below = Math.floor(place), above = Math.min(below + 1, sorted.length - 1);
  return sorted[below] + (place - below) * (sorted[above] - sorted[below]);
}
