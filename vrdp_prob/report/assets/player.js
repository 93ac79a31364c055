"use strict";
/* The player's controls: which world, when, how fast, seen from where. */

class Player {
  constructor(root, data, floor) {
    this.data = data;
    this.root = root;
    this.part = (name) => root.querySelector(`[data-part="${name}"]`);
    this.worlds = data.worlds.map((packed) => new World(packed));
    this.scene = new Scene(this.part("canvas"), data, floor, () => this.draw());
    this.views = { plane: new PlaneView(data) };
    if (data.camera) this.views.picture = new PictureView(data.camera);
    this.playing = false;
    this.time = 0;
  }

  async start() {
    this.fillWorlds();
    this.connect();
    this.scene.look(this.views.picture || this.views.plane);
    await this.show(this.worlds[0].key);
    this.seek(Math.min(this.world.end, this.data.seenUntil));
    this.root.dataset.ready = "true";
  }

  fillWorlds() {
    const groups = new Map();
    for (const world of this.worlds) {
      if (!groups.has(world.group)) groups.set(world.group, []);
      groups.get(world.group).push(new Option(world.label, world.key));
    }
    for (const [label, options] of groups) {
      const group = document.createElement("optgroup");
      group.label = label;
      group.append(...options);
      this.part("world").append(group);
    }
  }

  connect() {
    this.part("world").addEventListener("change", (event) => this.show(event.target.value));
    this.part("play").addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    this.part("time").addEventListener("input", (event) => { this.pause(); this.seek(Number(event.target.value)); });
    for (const name of ["paths", "measured", "film"]) this.part(name)?.addEventListener("change", () => this.draw());
    for (const choice of this.root.querySelectorAll("[name=view]")) {
      choice.addEventListener("change", () => { this.scene.look(this.views[choice.value]); this.draw(); });
    }
    this.root.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => { this.scene.resize(); this.draw(); }).observe(this.part("canvas"));
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.scene.restyle(); this.draw(); });
    for (const button of document.querySelectorAll("[data-world]")) {
      button.addEventListener("click", () => this.jump(button.dataset.world));
    }
  }

  key(event) {
    const range = event.target.type === "range";
    if (!range && event.target !== this.part("canvas")) return; /* other controls keep their own keys */
    if (range && event.key !== " ") return;
    const frame = 1 / this.data.frameRate;
    const moves = { ArrowLeft: -frame, ArrowRight: frame, Home: -Infinity, End: Infinity };
    if (event.key === " ") this.part("play").click();
    else if (event.key in moves) {
      this.pause();
      this.seek(this.time + moves[event.key] * (event.shiftKey ? 10 : 1));
    } else return;
    event.preventDefault();
  }

  /* The world that a question is about, from shortly before something happens in it. */
  async jump(key) {
    await this.show(key);
    const [first] = this.world.pairs;
    this.seek(first ? first.time - 0.6 : this.world.start);
    const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const box = this.root.getBoundingClientRect();
    if (box.top < 0 || box.top > 0.4 * innerHeight) {
      this.root.scrollIntoView({ behavior: calm ? "auto" : "smooth", block: "start" });
    }
    this.part("canvas").focus({ preventScroll: true });
    if (!calm) this.play();
  }

  async show(key) {
    const chosen = this.worlds.find((world) => world.key === key);
    this.wanted = chosen;
    await chosen.unpack();
    if (this.wanted !== chosen) return; /* another one was chosen meanwhile */
    this.world = chosen;
    this.part("world").value = key;
    const slider = this.part("time");
    slider.min = chosen.start;
    slider.max = chosen.end;
    slider.step = 1 / this.data.frameRate;
    for (const button of document.querySelectorAll("[data-world]")) {
      button.setAttribute("aria-pressed", String(button.dataset.world === key));
    }
    this.listPairs();
    this.seek(this.time);
  }

  seek(time) {
    this.time = Math.min(Math.max(time, this.world.start), this.world.end);
    this.part("time").value = this.time;
    const frame = Math.round((this.time - this.data.tracks.times[0]) * this.data.frameRate);
    const predicted = this.time > this.data.seenUntil + 1e-6 ? " · predicted" : "";
    const label = `${this.time.toFixed(2)} s · frame ${frame}${predicted}`;
    this.part("label").textContent = label;
    this.part("time").setAttribute("aria-valuetext", label);
    this.root.style.setProperty("--now", `${this.share(this.time)}%`);
    this.draw();
  }

  share(time) {
    return 100 * (time - this.world.start) / (this.world.end - this.world.start || 1);
  }

  draw() {
    if (!this.world) return;
    const checked = (name) => Boolean(this.part(name)?.checked);
    const real = ["factual", "future"].includes(this.world.kind) && this.time <= this.data.seenUntil + 1e-6;
    const shown = { paths: checked("paths"), measured: checked("measured"), film: checked("film") && real };
    this.scene.draw(this.world, this.time, shown);
    const name = `${this.world.label}, ${this.part("label").textContent}, ${this.world.draws} draws`;
    this.part("canvas").setAttribute("aria-label", name);
  }

  play() {
    if (this.time >= this.world.end - 1e-6) this.seek(this.world.start);
    this.playing = true;
    this.mark();
    let before = performance.now();
    const step = (now) => {
      if (!this.playing) return;
      this.seek(this.time + (now - before) / 1000 * Number(this.part("speed").value));
      before = now;
      if (this.time >= this.world.end) this.pause();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  pause() {
    this.playing = false;
    this.mark();
  }

  mark() {
    this.part("play").textContent = this.playing ? "Pause" : "Play";
  }

  /* A row for each pair that collides in some draw: when, and how probable that is. */
  listPairs() {
    const list = this.part("pairs");
    list.style.setProperty("--seen", `${Math.min(100, this.share(this.data.seenUntil))}%`);
    const rows = this.world.pairs.map((pair) => this.pairRow(pair));
    if (rows.length) rows.push(this.timeAxis());
    else {
      const none = document.createElement("li");
      none.textContent = "No draw has a collision in this world.";
      rows.push(none);
    }
    list.replaceChildren(...rows);
  }

  pairRow(pair) {
    const button = document.createElement("button");
    button.type = "button";
    const [first, second] = pair.bodies.map((body) => this.data.bodies[body]);
    button.append(span("pair-name", `${first.name} – ${second.name}`), this.strip(pair), span("pair-share", pair.share));
    const name = `${first.name} and ${second.name} collide with probability ${pair.share}, at about ${pair.time.toFixed(1)} s`;
    button.setAttribute("aria-label", `${name}; go there`);
    button.addEventListener("click", () => { this.pause(); this.seek(pair.time); });
    const row = document.createElement("li");
    row.append(button);
    return row;
  }

  /* Whole seconds under the strips; a screen reader hears the times from the rows. */
  timeAxis() {
    const marks = span("marks", "");
    const { start, end } = this.world;
    const step = [1, 2, 5, 10, 20, 50, 100].find((seconds) => (end - start) / seconds <= 6) || (end - start) / 4 || 1;
    for (let time = Math.ceil(start / step - 1e-6) * step; time <= end + 1e-6; time += step) {
      const mark = span("mark", `${Math.round(time)} s`);
      mark.style.left = `${this.share(time)}%`;
      marks.append(mark);
    }
    const row = document.createElement("li");
    row.className = "scale";
    row.setAttribute("aria-hidden", "true");
    row.append(span("", ""), marks);
    return row;
  }

  strip(pair) {
    const strip = span("strip", "");
    for (const time of this.world.contactTimes(pair.bodies)) {
      const tick = span("tick", "");
      tick.style.left = `${this.share(time)}%`;
      tick.style.opacity = Math.min(1, 0.15 + 4 / this.world.draws);
      strip.append(tick);
    }
    return strip;
  }
}

function span(name, text) {
  const element = document.createElement("span");
  element.className = name;
  element.textContent = text;
  return element;
}

async function startPlayer() {
  const root = document.getElementById("player");
  if (!root) return;
  try {
    const data = JSON.parse(document.getElementById("player-data").textContent);
    const picture = document.getElementById("floor");
    if (picture) await picture.decode();
    await new Player(root, data, picture).start();
  } catch (error) {
    root.querySelector("[data-part=problem]").hidden = false;
    throw error;
  }
}

addEventListener("beforeprint", () => {
  for (const details of document.querySelectorAll("details")) details.open = true;
});
startPlayer();
