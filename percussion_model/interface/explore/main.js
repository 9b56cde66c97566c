// The page: from a slider to what is drawn.
import { Drawing } from "./drawing.js";
import { Figures, prepared } from "./figures.js";
import { Inputs, bitTitle, shorter } from "./inputs.js";
import { short, unitOf } from "./numbers.js";
import { Player } from "./player.js";
import { numberTexts, rateText, showResult } from "./result.js";
import { Scene } from "./scene.js";
import { LENGTHS, OTHERS, SLIDERS, WORDS, fill } from "./words.js";

const part = id => document.getElementById(id);
const START = { hammer: "dth4", bit: "dth-115", rock: "kuru-granite" };
// A slower advance is rounding [m/s].
const LEAST_RATE = 1e-12;
// Points of a curve, time that a wish may take [ms], and how long the address waits [ms].
const POINTS = 13, MOST_TIME = 4000, ADDRESS_WAITS = 400;
const CURVES = [["feed.force", "overFeed", "force", "feed"], ["rotation.speed", "overSpeed", "turns", "rotation"]];

const state = { scene: null, found: null, blow: null, pinned: null, imperial: false, asked: 0, shown: 0, curves: {} };
const table = JSON.parse(part("table").textContent), tables = tablesOf(table, JSON.parse(part("catalogue").textContent));
let worker, inputs, figures, drawing, player, waiting;

function bytes(text) { return Uint8Array.from(atob(text.trim()), letter => letter.charCodeAt(0)); }

// ---- the worker

async function startWorker() {
  const source = part("worker").textContent;
  worker = new Worker(URL.createObjectURL(new Blob([source], { type: "text/javascript" })));
  worker.onmessage = ({ data }) => take(data);
  worker.onerror = event => { event.preventDefault(); crash(event.message); };
  const unpacked = new Blob([bytes(part("engine").textContent)]).stream().pipeThrough(new DecompressionStream("gzip"));
  const wasm = await new Response(unpacked).arrayBuffer();
  worker.postMessage({ wasm, table }, [wasm]);
}

// A worker that has died is followed by another, which waits for the next scene.
function crash(why) {
  worker.terminate();
  state.ready = false;
  state.found = { refusal: fill(WORDS.crashed, { why }) };
  state.shown = state.asked;
  showResult(state.found, state.pinned?.found, state.imperial);
  startWorker();
}

function fail(why) {
  showResult({ refusal: fill(WORDS.engine, { why }) }, null, state.imperial);
}

// Tables of the engine and of the page as scenes take them.
function tablesOf(table, catalogue) {
  const { presets, rocks, section } = table, bits = { ...table.bits };
  for (const [name, more] of Object.entries(catalogue.bits)) bits[name] = { ...bits[name], ...more };
  const rows = [...table.parameters, ...LENGTHS.map(({ key }) => ({ ...section[0], key, needs: {} }))];
  return { ...catalogue, presets, bits, rocks, section, rows: new Map(rows.map(row => [row.key, row])) };
}

// A scene, and what the worker must know besides.
function wishOf(scene) {
  const transits = scene.bars.map(transit), get = key => scene.get(key), drive = get("effects.drive");
  return {
    scene: scene.whole, busy: 1.6 * tables.transits * Math.max(...transits),
    mostTime: MOST_TIME, tooLong: fill(WORDS.tooLong, { seconds: MOST_TIME / 1000 }),
    known: {
      transits: [transits[0], Math.min(...transits)], cells: get("solver.cells"), loss: get("loss.time"), drive,
      step: get(`${drive}.step`), barrier: get("rock.barrier_threshold"),
    },
    curves: CURVES.filter(([key]) => key !== "rotation.speed" || get("effects.rotation")).map(([key]) => ({ key, places: state.curves[key].places })),
    interval: intervalOf(scene),
  };
}

// Time in which a wave crosses a bar [s].
function transit(bar) {
  return bar.reduce((sum, [length, , modulus, density]) => sum + length * Math.sqrt(density / modulus), 0);
}

// Samples of what is known of rock and bit, as analysis/rock_interval.py takes them.
function intervalOf(scene) {
  const known = scene.rock && tables.uncertain[scene.bitName]?.[scene.rock];
  if (!known || !scene.get("effects.breaking")) return null;
  const fits = known.every(([key, value]) => Math.abs(scene.get(key) / value - 1) < 1e-9);
  if (!fits) return null;
  const samples = tables.shares[known.length].map(shares => Object.fromEntries(known.map(([key, value, low, high], k) => {
    const share = shares[k], [from, to, part] = share >= 0.5 ? [value, high, 2 * share - 1] : [low, value, 2 * share];
    return [key, from <= 0 ? from + part * (to - from) : from * (to / from) ** part];
  })));
  return { samples, isString: scene.get("effects.string") };
}

function ask() {
  const { scene } = state;
  for (const [key] of CURVES) state.curves[key] = emptyCurve(scene, key);
  state.asked += 1;
  part("result").classList.add("waiting");
  fade(true); // until the next picture
  if (state.ready) send();
  clearTimeout(waiting);
  waiting = setTimeout(() => history.replaceState(null, "", `#${scene.link()}`), ADDRESS_WAITS);
}

function send() {
  state.began = performance.now();
  worker.postMessage({ id: state.asked, ...wishOf(state.scene) });
}

function emptyCurve(scene, key) {
  const slider = SLIDERS.find(one => one.key === key), value = scene.get(key);
  const low = Math.min(slider.low, value), high = Math.max(slider.high, value);
  const places = Array.from({ length: POINTS }, (_, k) => low + k / (POINTS - 1) * (high - low));
  return { low, high, places, points: [] };
}

// Specific energy beside the energy by advance, where the hole is known.
function addVolume(numbers) {
  const hole = state.scene.get("hole_diameter");
  if (hole > 0) numbers.specific_energy = numbers.energy_per_advance / (0.25 * Math.PI * hole * hole);
  return numbers;
}

// Take an answer of the worker.
function take(answer) {
  if (answer.ready) {
    state.ready = true;
    return state.asked === state.shown ? undefined : send();
  }
  if (answer.crashed) return crash(answer.crashed);
  if (answer.broken) return fail(answer.broken);
  if (answer.id !== state.asked) return undefined;
  if (answer.what === "refusal") {
    Object.assign(state, { found: { refusal: answer.text }, shown: answer.id, isOld: true });
    drawBlow(true);
  } else if (answer.what === "rate") {
    const waits = intervalOf(state.scene);
    const rate = Math.abs(answer.found.rate) < LEAST_RATE ? 0 : answer.found.rate, undamped = !state.scene.get("effects.loss") || state.scene.get("loss.time") === 0;
    state.found = { ...answer.found, rate, undamped, rock: state.scene.get("effects.rock"), interval: waits ? fill(WORDS.rockWaiting, { done: 0, count: waits.samples.length }) : state.scene.get("effects.breaking") ? WORDS.rockOwn : WORDS.rockMissing };
    addVolume(state.found.means);
    Object.assign(state, { shown: answer.id, took: performance.now() - state.began });
    drawCurves();
  } else if (answer.what === "errors") {
    Object.assign(state.found, { same: answer.same, errors: addVolume(answer.errors) });
  } else if (answer.what === "sampled") {
    state.found.interval = fill(WORDS.rockWaiting, answer);
  } else if (answer.what === "interval") {
    state.found.interval = { rock: shorter(tables.rocks[state.scene.rock].title), ends: answer.ends };
  } else if (answer.what === "picture") {
    state.isOld = !answer.picture;
    if (answer.picture) state.blow = prepared(answer.picture, state.scene);
    return drawBlow(true);
  } else if (answer.what === "point") {
    state.curves[answer.curve].points.push([answer.x, answer.rate]);
    return drawCurves(answer.curve);
  }
  return showResult(state.found, state.pinned?.found, state.imperial);
}

// ---- what is drawn

function range() {
  const { blow } = state, whole = part("view").value === "blow";
  return whole ? [blow.time[0], blow.period] : [Math.max(blow.time[0], -0.05 * blow.busy), Math.min(blow.busy, blow.period)];
}

// Whether what shows a blow is faded, as that of another scene.
function fade(isOld) {
  part("watch").classList.toggle("old", isOld);
  for (const id of ["waves", "forces", "path", "energy"]) part(id).parentNode.classList.toggle("old", isOld);
}

function drawBlow(keep) {
  part("old-blow").hidden = !(state.isOld && state.blow);
  part("old-blow").textContent = WORDS.oldBlow;
  fade(Boolean(state.isOld));
  if (!state.blow) return;
  part("waves").parentNode.hidden = !state.blow.fields.length;
  drawing.take(state.blow, state.scene, state.imperial, range());
  figures.draw(state.blow, state.pinned?.blow, range(), state.imperial);
  const { time, columns, greatest } = state.blow, first = !state.drawn;
  player.take(range(), keep && !first, time[columns.bit_force.indexOf(greatest.bit_force)]);
  state.drawn = true;
  if (first && !matchMedia("(prefers-reduced-motion: reduce)").matches) player.playOnce();
  describe();
}

function drawCurves(only) {
  part("turning").hidden = !state.scene.get("effects.rotation");
  for (const [key, plot, kind, name] of CURVES) {
    if ((only && only !== key) || (key === "rotation.speed" && part("turning").hidden)) continue;
    figures.drawRates(figures[plot], state.curves[key], state.pinned?.curves[key], [state.scene.get(key), state.found?.rate], kind, name, state.imperial);
  }
}

// Words for those who do not see the pictures.
function describe() {
  const { greatest, period } = state.blow, mega = (1e-6 * greatest.stress).toFixed(0), force = (1e-3 * greatest.bit_force).toFixed(0);
  part("drawing").setAttribute("aria-label", fill(WORDS.drawn, { mega, force }));
  for (const id of ["waves", "forces", "path", "energy"]) part(id).setAttribute("aria-label", fill(WORDS.plotted, { what: part(id).previousElementSibling.textContent, period: (1e3 * period).toFixed(1), force, mega }));
}

function change(scene) {
  state.scene = scene;
  part("refusal").hidden = true;
  inputs.show();
  ask();
}

function redraw() {
  inputs.imperial = state.imperial;
  inputs.show();
  if (state.found) showResult(state.found, state.pinned?.found, state.imperial);
  drawBlow(true);
  if (state.found) drawCurves();
}

// ---- buttons

function say(text) {
  part("said").textContent = text;
  setTimeout(() => { if (part("said").textContent === text) part("said").textContent = ""; }, 4000);
}

function copy(text) {
  const done = () => say(WORDS.copied);
  const byHand = () => {
    Object.assign(part("by-hand"), { value: text, hidden: false });
    part("by-hand").select();
    say(WORDS.notCopied);
  };
  if (navigator.clipboard) navigator.clipboard.writeText(text).then(done, byHand); else byHand();
}

function save(name, blob) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

function csv() {
  const { time, columns } = state.blow, keys = Object.keys(columns);
  const units = Object.fromEntries(table.columns.sample.map(({ name, unit }) => [name, unit]));
  const head = numberTexts(state.found, state.imperial).map(([name, text]) => `# ${name}: ${text}`);
  const rows = Array.from(time, (t, k) => [t, ...keys.map(key => columns[key][k])].join(","));
  return [`# percussion_model ${tables.version}: ${state.scene.link()}`, ...head, ["time since the blow began [s]", ...keys.map(key => units[key] ? `${key} [${units[key]}]` : key)].join(","), ...rows].join("\n");
}

function picture() {
  const canvases = [...document.querySelectorAll("canvas")].filter(one => one.offsetParent), columns = 2;
  const wide = Math.max(...canvases.map(one => one.width)), high = Math.max(...canvases.map(one => one.height));
  const sheet = Object.assign(document.createElement("canvas"), { width: columns * wide, height: Math.ceil(canvases.length / columns) * high }), pen = sheet.getContext("2d");
  pen.fillStyle = getComputedStyle(document.body).backgroundColor;
  pen.fillRect(0, 0, sheet.width, sheet.height);
  canvases.forEach((one, k) => pen.drawImage(one, k % columns * wide, Math.floor(k / columns) * high));
  sheet.toBlob(blob => save("percussion.png", blob));
}

function setTheme(dark) {
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  part("theme").setAttribute("aria-pressed", String(dark));
}

// What is pinned: its rate, names, and what the sliders say or was changed.
function pinnedWords() {
  const { scene, found, imperial } = state, shown = SLIDERS.filter(one => scene.matters(one.key));
  const changed = [...OTHERS, ...LENGTHS].filter(one => one.key in scene.values && scene.matters(one.key));
  const numbers = [...shown, ...changed].map(({ key, name, unit }) => {
    const [word, factor] = unitOf(unit, imperial);
    return `${name} ${short(factor * scene.get(key), 4)} ${word}`.trim();
  });
  const names = [scene.base.title, scene.bitName && bitTitle(tables.bits[scene.bitName], imperial), tables.rocks[scene.rock]?.title];
  return { rate: rateText(found, imperial).filter(Boolean).join(" ± "), name: [...names, ...numbers].filter(Boolean).join("; ") };
}

function pin() {
  state.pinned = state.pinned || !state.found || state.found.refusal ? null : { found: state.found, blow: state.blow, curves: { ...state.curves }, link: state.scene.link() };
  part("pin").setAttribute("aria-pressed", String(Boolean(state.pinned)));
  part("pin").textContent = state.pinned ? WORDS.unpin : WORDS.pin;
  part("pinned").hidden = !state.pinned;
  part("pinned").textContent = state.pinned ? fill(WORDS.pinned, pinnedWords()) : "";
  redraw();
}

function listen() {
  part("share").addEventListener("click", event => { if (event.target.tagName === "BUTTON" && part("by-hand").hidden) part("share").open = false; });
  part("share").addEventListener("keydown", event => { if (event.key === "Escape") part("share").open = false; });
  part("units").onclick = () => { state.imperial = !state.imperial; part("units").setAttribute("aria-pressed", String(state.imperial)); redraw(); };
  part("theme").onclick = () => { setTheme(document.documentElement.dataset.theme !== "dark"); redraw(); };
  part("pin").onclick = pin;
  part("reset").onclick = () => change(new Scene(tables, state.scene.hammer, state.scene.bit, state.scene.rock));
  part("link").onclick = () => copy(`${location.href.split("#")[0]}#${state.scene.link()}`);
  part("toml").onclick = () => copy(state.scene.toml());
  part("python").onclick = () => copy(state.scene.python());
  part("csv").onclick = () => state.blow && save("blow.csv", new Blob([csv()], { type: "text/csv" }));
  part("png").onclick = picture;
  part("view").onchange = () => { player.setSlow(part("view").value === "blow" ? 100 : 2000); drawBlow(false); };
  part("result").onclick = () => part("result").classList.toggle("open");
  let resizing;
  window.addEventListener("resize", () => { clearTimeout(resizing); resizing = setTimeout(redraw, 80); });
  window.addEventListener("hashchange", () => start(location.hash));
  document.addEventListener("keydown", event => {
    if (event.key === " " && event.target === document.body) { event.preventDefault(); player.play(!player.playing); }
  });
}

function start(hash) {
  const [scene, said] = hash.length > 1 ? Scene.fromLink(tables, hash.slice(1), START) : [new Scene(tables, START.hammer, START.bit, START.rock), ""];
  state.scene = scene;
  inputs.show();
  if (said) say(said);
  ask();
}

part("more").open = matchMedia("(min-width: 700px) and (max-width: 1149px)").matches;
setTheme(matchMedia("(prefers-color-scheme: dark)").matches);
figures = new Figures(t => { player.play(false); player.go(t); }, (key, x) => {
  const slider = CURVES.find(([one]) => one === key), [, factor] = unitOf(slider[2], state.imperial);
  inputs.set(key, Number((x / factor).toPrecision(4)));
});
drawing = new Drawing(part("drawing"));
player = new Player(t => { drawing.frame(t); figures.frame(t); });
inputs = new Inputs(() => state.scene, change);
part("about").textContent = fill(WORDS.about, { version: tables.version });
listen();
start(location.hash || `#${part("own").textContent}`);
globalThis.explorer = { state, tables, player, take, change: values => change(state.scene.with(values)), show: change, Scene };
startWorker().catch(error => fail(String(error?.message ?? error)));
