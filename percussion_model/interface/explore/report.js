// The last blow of a run in a report: the page's pictures of it, with time to move through; and drawings
// that a dragged box enlarges.
import { Drawing } from "./drawing.js";
import { Figures, prepared, stretch } from "./figures.js";
import { Player } from "./player.js";

const part = id => document.getElementById(id);

function numbers(letters, Kind = Float32Array) {
  return new Kind(Uint8Array.from(atob(letters), one => one.charCodeAt(0)).buffer);
}

function showBlow({ bars, hole, buttons, blow: packed, which }) {
  const columns = Object.fromEntries(Object.entries(packed.columns).map(([name, one]) => [name, numbers(one)]));
  const fields = packed.fields.map(({ bar, edges, time, kinetic, stress, scale }) => ({
    bar, edges: numbers(edges), time: numbers(time), kinetic: numbers(kinetic), stress: Float32Array.from(numbers(stress, Int16Array), one => scale * one) }));
  const scene = { bars, base: { hole }, tables: { bits: { own: { diameter: hole, buttons } } }, bitName: "own", rock: "" };
  const blow = prepared({ ...packed, time: numbers(packed.time), columns, fields }, scene);
  const figures = new Figures(t => { player.play(false); player.go(t); }), drawing = new Drawing(part("drawing"));
  const player = new Player(t => { drawing.frame(t); figures.frame(t); });
  const draw = keep => {
    const range = stretch(blow, part("view").value === "blow");
    drawing.take(blow, scene, false, range);
    figures.draw(blow, null, range, false);
    player.take(range, keep, blow.time[columns.bit_force.indexOf(blow.greatest.bit_force)]);
  };
  part("waves").parentNode.hidden = !fields.length;
  part("which").textContent = which;
  part("view").onchange = () => draw(false);
  window.addEventListener("resize", () => draw(true));
  draw(false);
  figures.describe();
  return { blow, player };
}

// A box that is dragged over a drawing fills it; a double click shows all of it again.
function enlarge(svg) {
  const whole = svg.getAttribute("viewBox"), box = document.createElementNS(svg.namespaceURI, "rect");
  const place = ({ clientX, clientY }) => new DOMPoint(clientX, clientY).matrixTransform(svg.getScreenCTM().inverse());
  let start = null;
  const sides = end => [Math.min(start.x, end.x), Math.min(start.y, end.y), Math.abs(end.x - start.x), Math.abs(end.y - start.y)];
  box.setAttribute("class", "box");
  svg.addEventListener("pointerdown", event => { start = place(event); svg.setPointerCapture(event.pointerId); });
  svg.addEventListener("pointermove", event => {
    if (!start) return;
    svg.append(box);
    ["x", "y", "width", "height"].forEach((name, k) => box.setAttribute(name, sides(place(event))[k]));
  });
  svg.addEventListener("pointerup", event => {
    const found = start && sides(place(event)), [, , wide] = whole.split(/\s+/).map(Number);
    if (found && Math.min(found[2], found[3]) > 0.01 * wide) svg.setAttribute("viewBox", found.join(" "));
    box.remove();
    start = null;
  });
  svg.addEventListener("dblclick", () => svg.setAttribute("viewBox", whole));
}

document.querySelectorAll("figure svg").forEach(enlarge);
const given = part("blow-data");
globalThis.report = given ? showBlow(JSON.parse(given.textContent)) : null;
