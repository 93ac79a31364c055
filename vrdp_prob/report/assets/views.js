"use strict";
/* Two ways to look at the plane. Each maps points to the canvas and gives outlines of bodies there. */

const ROUND = Array.from({ length: 20 }, (_, k) => [Math.cos(k * Math.PI / 10), Math.sin(k * Math.PI / 10)]);
const SQUARE = [[1, 1], [-1, 1], [-1, -1], [1, -1]];

/* Outline of a body in the plane, as points relative to its centre. */
function footprint(body, angle) {
  if (body.shape !== "cube") return ROUND.map(([x, y]) => [body.radius * x, body.radius * y]);
  const c = Math.cos(angle) * body.radius;
  const s = Math.sin(angle) * body.radius;
  return SQUARE.map(([x, y]) => [c * x - s * y, s * x + c * y]);
}

function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const kept = [];
    for (const p of list) {
      while (kept.length > 1) {
        const [a, b] = kept.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        kept.pop();
      }
      kept.push(p);
    }
    return kept.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/* As the camera sees it, on the floor of the still. */
class PictureView {
  constructor(camera) {
    this.camera = camera;
    this.showsFilm = true;
    this.aspect = camera.width / camera.height;
  }

  resize(width) {
    this.scale = width / this.camera.width;
  }

  point(x, y, z) {
    const [u, v, w] = this.camera.projection.map((row) => row[0] * x + row[1] * y + row[2] * z + row[3]);
    return [this.scale * u / w, this.scale * v / w];
  }

  depth({ x, y }) {
    const row = this.camera.projection[2];
    return row[0] * x + row[1] * y + row[3];
  }

  visible({ x, y }) {
    return this.depth({ x, y }) > 0;
  }

  /* Two polygons: the outline, and the top (null for a sphere). */
  outline(body, state) {
    const { x, y } = state;
    const r = body.radius;
    if (body.shape === "sphere") {
      const [u, v] = this.point(x, y, r);
      const across = this.camera.projection[0].slice(0, 3);
      const size = this.scale * r * this.sharpness(across) / this.depthAt(x, y, r);
      return [ROUND.map(([a, b]) => [u + size * a, v + size * b]), null];
    }
    const foot = footprint(body, state.angle);
    const ring = (z) => foot.map(([dx, dy]) => this.point(x + dx, y + dy, z));
    const top = ring(2 * r);
    return [hull([...ring(0), ...top]), top];
  }

  depthAt(x, y, z) {
    const row = this.camera.projection[2];
    return row[0] * x + row[1] * y + row[2] * z + row[3];
  }

  /* Focal length in pixels: what is left of a row of the projection across the viewing direction. */
  sharpness(row) {
    const view = this.camera.projection[2];
    const length = Math.hypot(...view.slice(0, 3));
    const along = row.reduce((sum, value, axis) => sum + value * view[axis] / length, 0);
    return Math.sqrt(Math.max(row.reduce((sum, value) => sum + value * value, 0) - along * along, 0));
  }

  /* A frame of the video as it is, or the floor made pale, so that what is drawn on it stands out. */
  backdrop(context, colors, [width, height], floor, frame) {
    const picture = frame || floor;
    if (picture) context.drawImage(picture, 0, 0, width, height);
    if (frame) return;
    context.globalAlpha = picture ? 0.45 : 1;
    context.fillStyle = colors.paper;
    context.fillRect(0, 0, width, height);
    context.globalAlpha = 1;
  }
}

/* From above; where there is a camera, its right is right and away from it is up. */
class PlaneView {
  constructor(data) {
    const { camera, view } = data;
    this.aspect = camera ? camera.width / camera.height : 1.5;
    this.right = [1, 0];
    this.pictureEdge = data.pictureEdge;
    const corners = [[view[0], view[1]], [view[0], view[3]], [view[2], view[1]], [view[2], view[3]]];
    if (camera) {
      const [cx, cy] = [(view[0] + view[2]) / 2, (view[1] + view[3]) / 2];
      const picture = new PictureView(camera);
      picture.resize(camera.width);
      const [here, x, y] = [[0, 0], [1e-3, 0], [0, 1e-3]].map(([dx, dy]) => picture.point(cx + dx, cy + dy, 0)[0]);
      const length = Math.hypot(x - here, y - here);
      if (length > 0) this.right = [(x - here) / length, (y - here) / length];
    }
    const turned = corners.map(([x, y]) => this.turned(x, y));
    this.low = [0, 1].map((axis) => Math.min(...turned.map((point) => point[axis])));
    this.high = [0, 1].map((axis) => Math.max(...turned.map((point) => point[axis])));
    this.margin = 1.6 * Math.max(...data.bodies.map((body) => body.radius));
  }

  turned(x, y) {
    const [a, b] = this.right;
    return [a * x + b * y, -b * x + a * y];
  }

  resize(width) {
    const size = [width, width / this.aspect];
    const spans = [0, 1].map((axis) => this.high[axis] - this.low[axis] + 2 * this.margin);
    this.scale = Math.min(size[0] / spans[0], size[1] / spans[1]);
    this.offset = [0, 1].map((axis) => size[axis] / 2 - this.scale * (this.low[axis] + this.high[axis]) / 2);
    this.size = size;
  }

  point(x, y) {
    const [a, b] = this.turned(x, y);
    return [this.offset[0] + this.scale * a, this.size[1] - this.offset[1] - this.scale * b];
  }

  depth() {
    return 0;
  }

  visible() {
    return true;
  }

  outline(body, state) {
    const ring = (size) => footprint({ ...body, radius: size * body.radius }, state.angle)
      .map(([dx, dy]) => this.point(state.x + dx, state.y + dy));
    return [ring(1), body.shape === "cylinder" ? ring(0.6) : null];
  }

  /* A grid of round lengths, and its scale. */
  backdrop(context, colors, [width, height]) {
    context.fillStyle = colors.paper;
    context.fillRect(0, 0, width, height);
    const wished = 70 / this.scale;
    const power = 10 ** Math.floor(Math.log10(wished));
    const step = power * [1, 2, 5, 10].find((factor) => factor * power >= wished);
    context.strokeStyle = colors.line;
    context.lineWidth = 1;
    context.beginPath();
    const pixels = step * this.scale;
    for (let u = this.offset[0] % pixels; u < width; u += pixels) { context.moveTo(u, 0); context.lineTo(u, height); }
    for (let v = (height - this.offset[1]) % pixels; v < height; v += pixels) { context.moveTo(0, v); context.lineTo(width, v); }
    context.stroke();
    const edge = this.pictureEdge ? "dashed: what the camera sees · " : "";
    if (edge) this.drawPictureEdge(context, colors);
    context.textAlign = "right";
    context.font = "12px system-ui, sans-serif";
    label(context, colors, `${edge}one square: ${+step.toPrecision(2)} m`, width - 10, height - 10, colors.muted);
  }

  drawPictureEdge(context, colors) {
    context.strokeStyle = colors.muted;
    context.setLineDash([4, 4]);
    context.beginPath();
    for (const [x, y] of this.pictureEdge) context.lineTo(...this.point(x, y));
    context.closePath();
    context.stroke();
    context.setLineDash([]);
  }
}

/* Text that stays readable over anything. */
function label(context, colors, text, u, v, color) {
  context.lineWidth = 3;
  context.strokeStyle = colors.paper;
  context.strokeText(text, u, v);
  context.fillStyle = color;
  context.fillText(text, u, v);
}
