// A plot on a canvas: axes and curves drawn once, a cursor over them in each frame.

export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

// Even places of ticks between two ends.
export function ticks(one, other, count) {
  const [low, high] = one < other ? [one, other] : [other, one];
  const rough = (high - low) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find(m => m * power >= rough);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) found.push(k * step);
  return found;
}

// A number beside an axis: short, whatever its size.
export function tickText(value) {
  const near = Number(value.toPrecision(6)), size = Math.abs(near);
  return near === 0 || (size >= 1e-3 && size < 1e5) ? String(near) : near.toExponential().replace("e+", "e");
}

// Round numbers between two ends on a logarithmic scale.
function decades(low, high) {
  const first = Math.floor(Math.log10(low)), count = Math.ceil(Math.log10(high)) - first;
  const all = Array.from({ length: count }, (_, n) => [1, 2, 5].map(m => m * 10 ** (first + n))).flat();
  return all.filter(one => one >= low && one <= high);
}

// A canvas as large as it is shown, in pixels of the screen.
export function fitted(canvas) {
  const scale = Math.min(window.devicePixelRatio || 1, 3), box = canvas.getBoundingClientRect();
  const width = Math.max(Math.round(box.width * scale), 10), height = Math.max(Math.round(box.height * scale), 10);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  return { width: width / scale, height: height / scale, scale };
}

export function shareOf(value, [low, high], log) {
  return log ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
}

function valueAt(share, [low, high], log) {
  const part = Math.min(Math.max(share, 0), 1);
  return log ? low * (high / low) ** part : low + part * (high - low);
}

export class Plot {
  // xName, yName: words of the axes. pick: what a press at an x does.
  constructor(canvas, pick) {
    this.canvas = canvas;
    this.still = document.createElement("canvas");
    this.drawn = false;
    if (!pick) return;
    canvas.style.cursor = "pointer";
    canvas.style.touchAction = "pan-y";
    const at = event => this.drawn && pick(this.xOf(event.clientX - canvas.getBoundingClientRect().left));
    canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); at(event); });
    canvas.addEventListener("pointermove", event => { if (event.buttons) at(event); });
  }

  xOf(pixel) { return valueAt((pixel - this.left) / (this.right - this.left), this.x, this.logs[0]); }
  yOf(pixel) { return valueAt((this.bottom - pixel) / (this.bottom - this.top), this.y, this.logs[1]); }
  px(x) { return this.left + shareOf(x, this.x, this.logs[0]) * (this.right - this.left); }
  py(y) { return this.bottom - shareOf(y, this.y, this.logs[1]) * (this.bottom - this.top); }

  // Begin anew: axes from x[0] to x[1] and y[0] to y[1], with names; logs: which are logarithmic.
  begin(x, y, xName, yName, logs = [false, false]) {
    const size = fitted(this.canvas), font = parseFloat(getComputedStyle(document.documentElement).fontSize) * 0.78;
    Object.assign(this.still, { width: this.canvas.width, height: this.canvas.height });
    const pen = this.pen = this.still.getContext("2d");
    pen.setTransform(size.scale, 0, 0, size.scale, 0, 0);
    pen.font = `${font}px system-ui, "DejaVu Sans", sans-serif`;
    Object.assign(this, { x, y, logs, left: 3.6 * font, right: size.width - 0.9 * font, top: 1.7 * font, bottom: size.height - 2.7 * font, scale: size.scale, font, drawn: true });
    pen.fillStyle = colour("soft");
    pen.strokeStyle = colour("grid");
    pen.lineWidth = 1;
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (const t of logs[0] ? decades(...x) : ticks(...x, (this.right - this.left) / (5.5 * font))) {
      this.line([[t, y[0]], [t, y[1]]], "grid", 1);
      pen.fillText(tickText(t), this.px(t), this.bottom + 0.3 * font);
    }
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const t of logs[1] ? decades(...y) : ticks(...y, (this.bottom - this.top) / (2.6 * font))) {
      this.line([[x[0], t], [x[1], t]], "grid", 1);
      if (this.py(t) > this.top + 0.5 * font) pen.fillText(tickText(t), this.left - 0.4 * font, this.py(t)); // the name is there
    }
    pen.textBaseline = "alphabetic";
    pen.fillText(xName, this.right, this.bottom + 2.4 * font);
    pen.textAlign = "left";
    pen.fillText(yName, 0.2 * font, 1.05 * font);
    return pen;
  }

  line(points, name, width = 1.6, dash = []) {
    const pen = this.pen;
    pen.save();
    pen.beginPath();
    pen.rect(this.left, this.top - 2, this.right - this.left, this.bottom - this.top + 4);
    pen.clip();
    pen.beginPath();
    for (const [x, y] of points) pen.lineTo(this.px(x), this.py(y));
    Object.assign(pen, { strokeStyle: colour(name) || name, lineWidth: width, lineJoin: "round" });
    pen.setLineDash(dash);
    pen.stroke();
    pen.restore();
  }

  // Copy what stands still, then a cursor at x, or a dot at x and y.
  frame(x, y) {
    if (!this.drawn) return;
    const pen = this.canvas.getContext("2d");
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.drawImage(this.still, 0, 0);
    pen.setTransform(this.scale, 0, 0, this.scale, 0, 0);
    if (x === undefined || x < this.x[0] || x > this.x[1]) return;
    pen.strokeStyle = pen.fillStyle = this.ink ??= colour("ink");
    if (y === undefined) {
      if (this.halo) { // over a picture that is as light as it is dark
        pen.fillStyle = "#fff";
        pen.fillRect(this.px(x) - 2, this.top, 4, this.bottom - this.top);
        pen.fillStyle = "#000";
      }
      pen.fillRect(this.px(x) - 0.75, this.top, 1.5, this.bottom - this.top);
    } else {
      pen.beginPath();
      pen.arc(this.px(x), this.py(y), 0.45 * this.font, 0, 2 * Math.PI);
      pen.fill();
    }
  }
}
