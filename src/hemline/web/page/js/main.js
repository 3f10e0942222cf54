// The page: it connects stage, picture and controls.

import { Controls } from "hemline/controls.js";
import { Scene } from "hemline/scene.js";
import { Stage } from "hemline/stage.js";

const LONGEST = 1 / 15; // longest time step of a picture [s]

/** Opens the page from the bytes of its data and kernels. `window.hemline` is the stage, for tests and experiments. */
export async function open(contents, code) {
  const stage = (window.hemline = await Stage.open(contents, code));
  const scene = new Scene(document.getElementById("picture"));
  const controls = new Controls(stage, {
    onChange(model, clip, betas) {
      const { seconds } = stage, same = stage.clip === stage.clips[clip];
      stage.choose(model, clip, betas);
      if (same) stage.seek(seconds);
    },
    onReshape: (betas) => stage.reshape(betas),
    onSeek: (seconds) => stage.seek(seconds),
  });
  controls.play(!matchMedia("(prefers-reduced-motion: reduce)").matches);
  let last = performance.now();
  const draw = (now) => {
    const dt = Math.min(Math.max(now - last, 1) / 1000, LONGEST) * controls.speed;
    last = now;
    if (controls.playing) stage.advance(dt);
    if (stage.changed) {
      stage.changed = false;
      stage.player.shade();
      scene.show(stage);
      controls.update();
    }
    scene.draw();
    requestAnimationFrame(draw);
  };
  document.getElementById("loading").hidden = true;
  requestAnimationFrame(draw);
}
