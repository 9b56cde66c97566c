// Figures of a study in its report: a map with cuts, or scatter over each parameter, and a table.
import { inDigits, short } from "./numbers.js";
import { Plot, shareOf, tickText } from "./plot.js";

const ROW = 26, ROOM = 40, FEW = 6, MOST_LINES = 9, WIDE = 10, COUNT = 0, GIVEN = 5, KNOWN = 3, PALE = 0.6;
const VIRIDIS = ["440154", "472d7b", "3b528b", "2c728e", "21918c", "28ae80", "5ec962", "addc30", "fde725"];

const study = JSON.parse(document.getElementById("study-data").textContent);
const numbers = (letters, Kind) => new Kind(Uint8Array.from(atob(letters), one => one.charCodeAt(0)).buffer);
const columns = Object.fromEntries(Object.entries(study.columns).map(([name, one]) => [name, numbers(one, Float32Array)]));
const keys = study.keys.map(one => ({ ...one, values: numbers(one.values, Float64Array) }));
const quantity = name => study.quantities.find(one => one.name === name);

function viridis(share) {
  const place = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1), k = Math.min(Math.floor(place), VIRIDIS.length - 2);
  const part = (text, at) => parseInt(text.slice(2 * at, 2 * at + 2), 16);
  return `rgb(${[0, 1, 2].map(at => Math.round(part(VIRIDIS[k], at) + (place - k) * (part(VIRIDIS[k + 1], at) - part(VIRIDIS[k], at))))})`;
}

// A number with the digits that are known; 0: a count or a mean of some.
function shown(value, digits) {
  if (!Number.isFinite(value)) return "–";
  if (digits === COUNT && Number.isInteger(value)) return String(value);
  return digits === GIVEN ? short(value, GIVEN) : inDigits(value, digits || KNOWN);
}

const isHidden = (name, k) => study.hideable.includes(name) && study.undecided[k] === 1;
const ofPoint = (name, k) => `shown ${shown(columns[name][k], quantity(name).digits)}; rate ${study.rates[k]} m/h; ${study.motions[k]}`;

function made(tag, parent, values = {}) {
  const one = Object.assign(document.createElement(tag), values);
  parent.append(one);
  return one;
}

// A place for a plot, with its title, and a line that tells of the point under the pointer.
function place(parent, title) {
  const figure = made("figure", parent), head = made("figcaption", figure, { textContent: title });
  const canvas = made("canvas", figure), told = made("p", figure, { className: "told", textContent: "\u00a0" });
  canvas.setAttribute("role", "img");
  return { plot: new Plot(canvas), canvas, head, told };
}

// What a box does that is dragged, a double click, and a move of the pointer.
function watch({ plot, canvas }, { take, all, move }) {
  let start = null;
  const at = event => { const box = canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; };
  const sorted = (one, other) => [Math.min(one, other), Math.max(one, other)];
  canvas.addEventListener("pointerdown", event => { start = at(event); canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointermove", event => {
    const [x, y] = at(event);
    if (!start) return move(plot.xOf(x), plot.yOf(y));
    plot.frame();
    const pen = canvas.getContext("2d");
    pen.strokeStyle = "#0072b2";
    return pen.strokeRect(start[0], start[1], x - start[0], y - start[1]);
  });
  canvas.addEventListener("pointerup", event => {
    const [x, y] = at(event), [a, b] = start ?? [x, y];
    start = null;
    plot.frame();
    if (Math.min(Math.abs(x - a), Math.abs(y - b)) > FEW) take(sorted(plot.xOf(a), plot.xOf(x)), sorted(plot.yOf(b), plot.yOf(y)), event.shiftKey);
  });
  canvas.addEventListener("dblclick", all);
}

function selector(parent, change) {
  const label = made("label", parent, { textContent: "Show " }), select = made("select", label, { id: "shown" });
  for (const { name, title } of study.quantities) made("option", select, { value: name, textContent: title });
  select.onchange = change;
  return select;
}

const limits = values => {
  const known = values.filter(Number.isFinite), low = known.length ? Math.min(...known) : 0, high = known.length ? Math.max(...known) : 1;
  return [low, high > low ? high : low + 1e-3 * (Math.abs(low) || 1)];
};

// A map over two axes and cuts through it; sliders for the other axes.
function map(box) {
  const { axes: [x, y, ...others] } = study, controls = made("div", box, { className: "controls" }), select = selector(controls, draw);
  const sliders = others.map(axis => {
    const label = made("label", controls, { textContent: `${axis.label} ` }), told = made("output", label);
    const slider = made("input", label, { type: "range", min: 0, max: axis.values.length - 1, step: 1, value: axis.here, id: axis.key });
    slider.oninput = draw;
    return () => { told.textContent = shown(axis.values[slider.value], GIVEN); return axis.stride * slider.value; };
  });
  const plots = made("div", box, { className: "plots" }), left = place(plots, ""), right = place(plots, "");
  const key = made("p", box, { className: "scale" }), logs = [x.scale === "log", y.scale === "log"], all = [x, y].map(one => [one.edges[0], one.edges.at(-1)]);
  let range = all, cells = [];
  const rows = [...new Set(Array.from({ length: Math.min(y.values.length, MOST_LINES) }, (_, k, n = Math.min(y.values.length, MOST_LINES)) => Math.round(k / Math.max(n - 1, 1) * (y.values.length - 1))))];
  function draw() {
    const name = select.value, base = sliders.reduce((sum, one) => sum + one(), 0), { title, digits, unit } = quantity(name);
    cells = y.values.flatMap((_, j) => x.values.map((_, i) => base + j * y.stride + i * x.stride));
    const values = cells.map(k => isHidden(name, k) ? NaN : columns[name][k]), [low, high] = limits(values);
    // a map over more than a decade would be of one colour
    const steps = low > 0 && high > WIDE * low, share = v => shareOf(v, [low, high], steps);
    drawCells(name, values, share);
    left.head.textContent = title;
    right.head.textContent = `Cuts: ${y.label} from ${tickText(Math.min(...y.values))} (dark) to ${tickText(Math.max(...y.values))} (light)`;
    right.plot.begin(range[0], [low - 0.05 * (high - low), high + 0.05 * (high - low)], x.label, title, [logs[0], false]);
    rows.forEach((row, k) => right.plot.line(x.values.map((at, i) => [at, values[row * x.values.length + i]]), viridis(0.92 * k / Math.max(rows.length - 1, 1)), 2));
    right.plot.frame();
    const undecided = values.some((_, j) => isHidden(name, cells[j]));
    key.innerHTML = `<span>${shown(low, digits)}</span><i></i><span>${shown(high, digits)} ${unit}${steps ? ", logarithmic" : ""}</span>${undecided ? `<b>hatched: ${study.word}, error ≥ rate</b>` : ""}`;
  }
  function drawCells(name, values, share) {
    const { plot } = left, pen = plot.begin(...range, x.label, y.label, logs);
    pen.save();
    pen.beginPath();
    pen.rect(plot.left, plot.top, plot.right - plot.left, plot.bottom - plot.top);
    pen.clip();
    values.forEach((value, at) => {
      const i = at % x.values.length, j = Math.floor(at / x.values.length);
      const [a, b, c, d] = [plot.px(x.edges[i]), plot.px(x.edges[i + 1]), plot.py(y.edges[j]), plot.py(y.edges[j + 1])];
      const isLight = !Number.isFinite(value) || share(value) > PALE;
      pen.fillStyle = Number.isFinite(value) ? viridis(share(value)) : isHidden(name, cells[at]) ? "#eeeeee" : "#dddddd";
      pen.fillRect(a, d, b - a + 0.5, c - d + 0.5);
      pen.lineWidth = 1.5;
      const line = (colour, ...ends) => { pen.strokeStyle = colour; pen.beginPath(); ends.forEach(end => pen.lineTo(...end)); pen.stroke(); };
      if (isHidden(name, cells[at])) for (let u = a; u < b; u += 8) line("#666666", [u, c], [Math.min(u + (c - d), b), Math.max(d, c - (b - u))]);
      const [u, v] = [plot.px(x.values[i]), plot.py(y.values[j])];
      if (study.motions[cells[at]] !== "periodic") {
        for (const rise of [-4, 4]) line(isLight ? "#000000" : "#ffffff", [u - 4, v - rise], [u + 4, v + rise]);
      }
    });
    pen.restore();
    plot.frame();
  }
  const next = (values, at, log) => values.reduce((best, one, k) => Math.abs(log ? Math.log(one / at) : one - at) < Math.abs(log ? Math.log(values[best] / at) : values[best] - at) ? k : best, 0);
  watch(left, {
    take: (a, b) => { range = [a, b]; draw(); },
    all: () => { range = all; draw(); },
    move: (a, b) => {
      const i = next(x.values, a, logs[0]), j = next(y.values, b, logs[1]);
      left.told.textContent = `${x.key} ${shown(x.values[i], GIVEN)}, ${y.key} ${shown(y.values[j], GIVEN)}: ${ofPoint(select.value, cells[j * x.values.length + i])}`;
    },
  });
  draw();
  return { draw, cells: () => cells.map(k => [isHidden(select.value, k) ? null : columns[select.value][k], study.undecided[k] ? study.word : "", study.rates[k]]) };
}

// What is shown over each parameter; points in a box that is dragged stand out in all panels.
function scatter(box) {
  const select = selector(made("div", box, { className: "controls" }), draw), plots = made("div", box, { className: "plots" });
  const panels = keys.map(({ key, values }) => ({ ...place(plots, ""), key, values, range: null })), count = study.motions.length;
  let chosen = null;
  const bars = k => select.value === "rate" && Number.isFinite(columns.off[k]) ? columns.off[k] : 0, colourOf = k => study.undecided[k] ? "#bbbbbb" : study.colours[study.motions[k]];
  function draw() {
    const name = select.value, values = columns[name], [low, high] = limits(Array.from(values, (v, k) => [v - bars(k), v + bars(k)]).flat());
    for (const panel of panels) {
      const { plot, head, values: at, range, key } = panel, [from, to] = limits(Array.from(at)), room = (a, b) => [a - 0.05 * (b - a), b + 0.05 * (b - a)];
      head.textContent = quantity(name).title;
      const pen = plot.begin(...(range ?? [room(from, to), room(low, high)]), keys.find(one => one.key === key).label, "");
      const rises = at.every((v, k) => k === 0 || v >= at[k - 1]);
      if (keys.length === 1 && rises) plot.line(Array.from(at, (v, k) => [v, values[k]]), "#0072b2");
      for (let k = 0; k < count; k++) {
        if (!Number.isFinite(values[k])) continue;
        pen.globalAlpha = chosen && !chosen[k] ? 0.06 : 0.7;
        if (bars(k)) plot.line([[at[k], values[k] - bars(k)], [at[k], values[k] + bars(k)]], colourOf(k), 1);
        pen.fillStyle = colourOf(k);
        pen.beginPath();
        pen.arc(plot.px(at[k]), plot.py(values[k]), 2.5, 0, 2 * Math.PI);
        pen.fill();
      }
      pen.globalAlpha = 1;
      plot.frame();
    }
  }
  for (const panel of panels) {
    const inside = ([a, b], [c, d]) => k => panel.values[k] >= a && panel.values[k] <= b && columns[select.value][k] >= c && columns[select.value][k] <= d;
    watch(panel, {
      take: (x, y, enlarge) => {
        if (enlarge) panel.range = [x, y]; else chosen = Array.from({ length: count }, (_, k) => inside(x, y)(k));
        draw();
      },
      all: () => { panel.range = chosen = null; draw(); },
      move: (a, b) => {
        const { plot } = panel, far = k => Math.hypot(plot.px(panel.values[k]) - plot.px(a), plot.py(columns[select.value][k]) - plot.py(b));
        let best = 0;
        for (let k = 1; k < count; k++) if (far(k) < far(best) || Number.isNaN(far(best))) best = k;
        panel.told.textContent = `${panel.key} ${shown(panel.values[best], GIVEN)}: ${ofPoint(select.value, best)}`;
      },
    });
  }
  draw();
  return { draw, bars: k => bars(k), colourOf };
}

// All points; a click on a heading sorts. Only the rows that are seen are there.
function table(box) {
  const heads = [...keys.map(({ label, values }) => [label, k => values[k], k => shown(values[k], GIVEN)]),
    ["motion", k => study.motions[k]], ["rate is", k => study.undecided[k] ? study.word : ""],
    ...study.quantities.map(({ name, title, digits }) => [title, k => columns[name][k], k => shown(columns[name][k], digits)])];
  const order = study.motions.map((_, k) => k), frame = made("div", box, { className: "points", tabIndex: 0 }), grid = made("table", frame);
  const row = made("tr", made("thead", grid)), body = made("tbody", grid);
  let sorted = null, rises = true;
  const draw = () => {
    const first = Math.max(0, Math.floor(frame.scrollTop / ROW) - 5), last = Math.min(order.length, first + ROOM);
    const gap = count => `<tr style="height:${count * ROW}px"></tr>`;
    body.innerHTML = gap(first) + order.slice(first, last).map(k => `<tr>${heads.map(([, value, text = value]) => `<td>${text(k)}</td>`).join("")}</tr>`).join("") + gap(order.length - last);
  };
  heads.forEach(([name, value], at) => {
    made("button", made("th", row), { type: "button", textContent: name }).onclick = () => {
      rises = sorted === at ? !rises : true;
      sorted = at;
      const rank = k => { const v = value(k); return typeof v === "number" && !Number.isFinite(v) ? -Infinity : v; };
      order.sort((a, b) => (rank(a) < rank(b) ? -1 : rank(a) > rank(b) ? 1 : 0) * (rises ? 1 : -1));
      draw();
    };
  });
  frame.onscroll = draw;
  draw();
}

const figure = study.axes ? map(document.getElementById("map")) : scatter(document.getElementById("scatter"));
table(document.getElementById("points"));
window.addEventListener("resize", figure.draw);
globalThis.study = { ...figure, shown: (name, value) => shown(value, quantity(name).digits), columns, rates: study.rates };
