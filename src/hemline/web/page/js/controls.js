// Buttons, lists and sliders of the page.

const SLIDERS = 6; // number of betas with a slider

const element = (id) => document.getElementById(id);

export class Controls {
  /** Calls `onChange` for another garment or clip, `onReshape` for another shape, `onSeek` for another time. */
  constructor(stage, { onChange, onReshape, onSeek }) {
    Object.assign(this, { stage, onChange, onReshape, onSeek, playing: true, speed: 1, spans: [] });
    this.#fill("garment", stage.metadata.models.map(({ name }) => name));
    this.#fill("clip", stage.metadata.clips.map(({ name }) => name));
    for (const id of ["garment", "clip"]) element(id).addEventListener("change", () => this.#choose());
    element("play").addEventListener("click", () => this.play(!this.playing));
    element("time").addEventListener("input", ({ target }) => {
      this.play(false);
      this.onSeek(Number(target.value) * this.stage.clip.seconds);
    });
    element("speed").addEventListener("input", ({ target }) => {
      this.speed = Number(target.value);
      element("speed-said").textContent = `${this.speed.toFixed(2)} ×`;
    });
    document.addEventListener("keydown", (event) => {
      if (event.key !== " " || event.target.tagName === "SELECT" || event.target.tagName === "BUTTON") return;
      event.preventDefault();
      this.play(!this.playing);
    });
    element("notices").textContent = stage.metadata.notices.join("\n\n");
    this.#sliders();
  }

  play(playing) {
    this.playing = playing;
    element("play").textContent = playing ? "Pause" : "Play";
  }

  /** Shows the time of the clip, and the time that frames take. */
  update() {
    const { clip, seconds, player } = this.stage;
    element("time").value = clip.seconds > 0 ? seconds / clip.seconds : 0;
    element("time-said").textContent = `${seconds.toFixed(2)} of ${clip.seconds.toFixed(2)} s`;
    if (!this.playing) return; // the first frame after a start searches the whole skin
    this.spans = [...this.spans.slice(-59), player.milliseconds];
    const mean = (stage) => this.spans.reduce((sum, each) => sum + each[stage], 0) / this.spans.length;
    const parts = ["body", "animator", "push"].map((stage) => `${stage} ${mean(stage).toFixed(1)}`);
    element("milliseconds").textContent = `${mean("all").toFixed(1)} ms a frame (${parts.join(", ")})`;
  }

  #choose() {
    this.spans = [];
    this.onChange(element("garment").selectedIndex, element("clip").selectedIndex, this.#betas());
    this.#sliders();
  }

  #betas() {
    return Array.from(document.querySelectorAll("#shape input"), ({ value }) => Number(value));
  }

  /** Makes a slider for each of the first betas, for garments that follow shapes. */
  #sliders() {
    const { beta_range: range } = this.stage.player.metadata, shape = element("shape");
    element("shapes").hidden = !range;
    if (!range || shape.childElementCount) return;
    Array.from(this.stage.body.betas.slice(0, SLIDERS)).forEach((beta, i) => {
      const label = document.createElement("label"), slider = document.createElement("input");
      Object.assign(slider, { type: "range", min: range[0], max: range[1], step: 0.1, value: beta });
      slider.addEventListener("input", () => this.onReshape(this.#betas()));
      label.append(i === 0 ? "stature" : `shape ${i + 1}`, slider);
      shape.append(label);
    });
  }

  #fill(id, names) {
    element(id).replaceChildren(...names.map((name) => Object.assign(document.createElement("option"), { textContent: name })));
    element(id).parentElement.hidden = names.length < 2;
  }
}
