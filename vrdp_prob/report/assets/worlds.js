"use strict";
/* The rollouts of each world: unpacking (see payload.py) and the state of every draw at any time. */

async function inflate(base64) {
  const packed = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).arrayBuffer();
}

/* 16-bit second differences in time, least byte first, back to values; every sum is modulo 2^16. */
function undoDifferences(buffer, frames) {
  const bytes = new DataView(buffer);
  const values = new Int16Array(buffer.byteLength / 2);
  for (let start = 0; start < values.length; start += frames) {
    let change = 0;
    let value = 0;
    for (let frame = 0; frame < frames; frame++) {
      change = (change + bytes.getInt16(2 * (start + frame), true)) << 16 >> 16;
      value = (value + change) << 16 >> 16;
      values[start + frame] = value;
    }
  }
  return values;
}

class World {
  constructor(packed) {
    Object.assign(this, packed);
    this.frames = this.times.length;
    this.start = this.times[0];
    this.end = this.times[this.frames - 1];
    this.values = null;
  }

  async unpack() {
    if (!this.values) {
      this.values = undoDifferences(await inflate(this.data), this.frames);
      this.data = null;
    }
    return this;
  }

  bodyIndices() {
    return [...this.first[0].keys()];
  }

  /* Frame at or before a time, and how far (0 to 1) the time is on the way to the next one. */
  place(time) {
    let low = 0;
    let high = this.frames - 1;
    if (time >= this.end) return [high, 0];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (this.times[middle] <= time) low = middle;
      else high = middle;
    }
    const span = this.times[high] - this.times[low];
    return [low, span > 0 ? Math.max(0, (time - this.times[low]) / span) : 0];
  }

  /* {x, y, angle} of a body in a draw, or null before it is there and after it has left. */
  state(draw, body, [frame, share]) {
    const until = this.until[draw][body];
    if (frame < this.first[draw][body] || frame >= until) return null;
    const at = (axis) => {
      const index = ((body * 3 + axis) * this.draws + draw) * this.frames + frame;
      const now = this.values[index];
      const next = frame + 1 < until ? this.values[index + 1] : now;
      const change = axis === 2 ? (next - now) << 16 >> 16 : next - now; /* the short way round */
      return now + share * change;
    };
    return { x: at(0) * this.step, y: at(1) * this.step, angle: at(2) * 2 * Math.PI / 65536 };
  }

  /* Times of a pair's first contact in the draws shown. */
  contactTimes([first, second]) {
    const { time, bodies } = this.collisions;
    return time.filter((_, row) => bodies[row][0] === first && bodies[row][1] === second);
  }
}
