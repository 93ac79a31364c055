"use strict";
/* Drawing of one moment of one world: all draws faintly over each other, so that agreement is dense and doubt is thin. */

const FLASH_SECONDS = 0.3;

class Scene {
  constructor(canvas, data, floor, redraw) {
    this.canvas = canvas;
    this.data = data;
    this.floor = floor;
    this.film = data.film && new Film(data.film, redraw);
    this.still = matchMedia("(prefers-reduced-motion: reduce)");
    this.paths = document.createElement("canvas");
    this.restyle();
  }

  restyle() {
    const style = getComputedStyle(this.canvas);
    const value = (name) => style.getPropertyValue(name).trim();
    this.colors = { paper: value("--paper"), ink: value("--ink"), muted: value("--muted"), line: value("--line") };
    this.bodyColors = this.data.bodies.map((body) => value(`--c-${body.color}`));
    this.pathsOf = null;
  }

  look(view) {
    this.view = view;
    this.resize();
  }

  resize() {
    const width = this.canvas.clientWidth;
    const height = Math.round(width / this.view.aspect);
    const ratio = window.devicePixelRatio || 1;
    this.canvas.style.aspectRatio = String(this.view.aspect);
    for (const canvas of [this.canvas, this.paths]) {
      canvas.width = Math.max(1, Math.round(width * ratio));
      canvas.height = Math.max(1, Math.round(height * ratio));
    }
    this.size = [width, height];
    this.ratio = ratio;
    this.view.resize(width);
    this.pathsOf = null;
  }

  context(canvas) {
    const context = canvas.getContext("2d");
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    return context;
  }

  draw(world, time, { paths, measured, film }) {
    if (!this.size[0]) return; /* not laid out */
    const context = this.context(this.canvas);
    const frame = film && this.film && this.view.showsFilm ? this.film.frame(time) : null;
    this.view.backdrop(context, this.colors, this.size, this.floor, frame);
    this.drawWalls(context);
    if (paths) this.drawPaths(context, world);
    const centres = this.drawBodies(context, world, time, frame);
    this.drawFlashes(context, world, time);
    if (measured) this.drawMeasured(context, world, time);
    this.drawTags(context, centres);
  }

  drawWalls(context) {
    context.strokeStyle = this.colors.ink;
    context.lineWidth = 2;
    for (const ends of this.data.walls) {
      context.beginPath();
      for (const [x, y] of ends) context.lineTo(...this.view.point(x, y, 0));
      context.stroke();
    }
  }

  /* Whole paths change only with world, view and size: they are kept as a picture. */
  drawPaths(context, world) {
    if (this.pathsOf !== world) {
      const layer = this.context(this.paths);
      layer.clearRect(0, 0, ...this.size);
      layer.lineWidth = 1.2;
      layer.globalAlpha = Math.min(0.5, 4 / world.draws);
      for (const body of world.bodyIndices()) {
        layer.strokeStyle = this.bodyColors[body];
        for (let draw = 0; draw < world.draws; draw++) this.strokePath(layer, world, draw, body);
      }
      this.pathsOf = world;
    }
    context.drawImage(this.paths, 0, 0, ...this.size);
  }

  strokePath(layer, world, draw, body) {
    const height = this.data.bodies[body].radius;
    layer.beginPath();
    for (let frame = world.first[draw][body]; frame < world.until[draw][body]; frame++) {
      const state = world.state(draw, body, [frame, 0]);
      if (this.view.visible(state)) layer.lineTo(...this.view.point(state.x, state.y, height));
    }
    layer.stroke();
  }

  /* Filled bodies; over a frame of the video white outlines, which leave the real objects in sight. */
  drawBodies(context, world, time, frame) {
    const place = world.place(time);
    const standing = [];
    for (const body of world.bodyIndices()) {
      for (let draw = 0; draw < world.draws; draw++) {
        const state = world.state(draw, body, place);
        if (state && this.view.visible(state)) standing.push({ body, state, depth: this.view.depth(state) });
      }
    }
    standing.sort((a, b) => b.depth - a.depth);
    const opacity = 1 - 0.04 ** (1 / world.draws);
    for (const { body, state } of standing) {
      const [outline, top] = this.view.outline(this.data.bodies[body], state);
      context.fillStyle = this.bodyColors[body];
      context.strokeStyle = frame ? "#fff" : this.bodyColors[body];
      context.lineWidth = 1;
      tracePolygon(context, outline);
      context.globalAlpha = opacity;
      if (!frame) context.fill();
      context.globalAlpha = Math.min(1, 1.6 * opacity);
      context.stroke();
      if (top && !frame) {
        context.fillStyle = "#fff";
        context.globalAlpha = 0.35 * opacity;
        tracePolygon(context, top);
        context.fill();
      }
    }
    context.globalAlpha = 1;
    return this.centres(standing);
  }

  /* Where most draws have each body: the middle by each coordinate. */
  centres(standing) {
    const found = new Map();
    for (const { body, state } of standing) {
      if (!found.has(body)) found.set(body, { xs: [], ys: [] });
      found.get(body).xs.push(state.x);
      found.get(body).ys.push(state.y);
    }
    const middle = (list) => list.sort((a, b) => a - b)[list.length >> 1];
    return [...found].map(([body, { xs, ys }]) => ({ body, x: middle(xs), y: middle(ys) }));
  }

  drawFlashes(context, world, time) {
    const { draw, time: times, bodies, point } = world.collisions;
    const height = (pair) => this.data.bodies[pair[0]].radius;
    context.strokeStyle = this.colors.ink;
    context.lineWidth = 1.5;
    for (let row = 0; row < draw.length; row++) {
      const age = (time - times[row]) / FLASH_SECONDS;
      if (age < 0 || age > 1) continue;
      const [u, v] = this.view.point(...point[row], height(bodies[row]));
      context.globalAlpha = Math.min(1, 5 / world.draws) * (1 - age);
      context.beginPath();
      context.arc(u, v, this.still.matches ? 14 : 6 + 16 * age, 0, 2 * Math.PI);
      context.stroke();
    }
    context.globalAlpha = 1;
  }

  /* Where each body was seen; not that of a body which this world goes without. */
  drawMeasured(context, world, time) {
    const { times, positions } = this.data.tracks;
    const tolerance = 0.75 / this.data.frameRate;
    let frame = 0;
    times.forEach((other, index) => { if (Math.abs(other - time) < Math.abs(times[frame] - time)) frame = index; });
    if (Math.abs(times[frame] - time) > tolerance) return;
    positions.forEach((column, body) => {
      if (!column[frame] || (world.kind === "removed" && this.data.bodies[body].id === world.body)) return;
      const [u, v] = this.view.point(...column[frame], this.data.bodies[body].radius);
      for (const [color, width] of [[this.colors.paper, 4], [this.colors.ink, 1.5]]) {
        context.strokeStyle = color;
        context.lineWidth = width;
        context.beginPath();
        context.moveTo(u - 5, v);
        context.lineTo(u + 5, v);
        context.moveTo(u, v - 5);
        context.lineTo(u, v + 5);
        context.stroke();
      }
    });
  }

  drawTags(context, centres) {
    context.font = "600 12px system-ui, sans-serif";
    context.textAlign = "center";
    for (const { body, x, y } of centres) {
      const radius = this.data.bodies[body].radius;
      const [outline] = this.view.outline(this.data.bodies[body], { x, y, angle: 0 });
      const top = Math.min(...outline.map((point) => point[1]));
      const [u] = this.view.point(x, y, radius);
      label(context, this.colors, this.data.bodies[body].tag, u, top - 5, this.colors.ink);
    }
  }
}

function tracePolygon(context, points) {
  context.beginPath();
  points.forEach((point, index) => (index ? context.lineTo(...point) : context.moveTo(...point)));
  context.closePath();
}

/* Frames of the video, decoded when they are first needed. */
class Film {
  constructor({ times, pictures }, redraw) {
    this.times = times;
    this.pictures = pictures;
    this.images = [];
    this.redraw = redraw;
  }

  /* The last frame that is not later than a time, null while it is being decoded. */
  frame(time) {
    let index = 0;
    while (index + 1 < this.times.length && this.times[index + 1] <= time + 1e-6) index++;
    if (!this.images[index]) {
      const image = new Image();
      image.src = `data:image/jpeg;base64,${this.pictures[index]}`;
      image.decode().then(this.redraw);
      this.images[index] = image;
    }
    return this.images[index].complete ? this.images[index] : null;
  }
}
