// The page: from a slider to what is drawn.
import { Engine } from "../../engine/engine.js";
import { Drawing } from "./drawing.js";
import { Figures, prepared, stretch } from "./figures.js";
import { Inputs, bitTitle, shorter } from "./inputs.js";
import { short, unitOf } from "./numbers.js";
import { Judge, RATE } from "./judge.js";
import { notesOf, unusual } from "./notes.js";
import { Overtaken, Pool } from "./pool.js";
import { Player } from "./player.js";
import { numberTexts, rateText, showResult } from "./result.js";
import { Scene } from "./scene.js";
import { LENGTHS, OTHERS, SLIDERS, WORDS, fill } from "./words.js";

const part = id => document.getElementById(id);
const STAGE = location.search === "?stage";
const START = { hammer: "dth4", bit: "dth-115", rock: "kuru-granite" };
// A slower advance is rounding [m/s].
const LEAST_RATE = 1e-12;
// A bit that turns by less between blows stands still [m].
const STILL = 1e-7;
// Points of a curve, time that a wish may take [ms], and how long the address waits [ms].
const POINTS = 13, MOST_TIME = 8000, ADDRESS_WAITS = 400;
// Points of a curve are known to this share, and progress is told so often [ms].
const CURVE_SCATTER = 5e-3, TOLD = 300;
// Curves have more points where one lies so far off the line between its neighbours, by the greatest rate;
// no closer than a share of their width, and no more than so many.
const BEND = 0.01, LEAST_STRETCH = 0.004, MOST_POINTS = 45;
const CURVES = [["feed.force", "overFeed", "force", "feed"], ["rotation.speed", "overSpeed", "turns", "rotation"]];

const state = { scene: null, found: null, blow: null, pinned: null, imperial: false, asked: 0, shown: 0, curves: {} };
const table = JSON.parse(part("table").textContent), tables = tablesOf(table, JSON.parse(part("catalogue").textContent));
let pool, judge, inputs, figures, drawing, player, waiting;

function bytes(text) { return Uint8Array.from(atob(text.trim()), letter => letter.charCodeAt(0)); }

// ---- the engine

async function startEngine() {
  const source = URL.createObjectURL(new Blob([part("worker").textContent], { type: "text/javascript" }));
  const unpacked = new Blob([bytes(part("engine").textContent)]).stream().pipeThrough(new DecompressionStream("gzip"));
  const module = await WebAssembly.compile(await new Response(unpacked).arrayBuffer());
  judge = new Judge(await Engine.load(module, table), tables.settled);
  pool = new Pool(() => {
    const worker = new Worker(source);
    worker.postMessage({ module, table });
    return worker;
  }, crash);
  if (state.asked !== state.shown) send();
}

// A worker has died at a scene: the next scene has others.
function crash(why) {
  pool.wish(state.asked += 0.5); // nothing more of this one
  state.shown = state.asked;
  showRefusal(fill(WORDS.crashed, { why }));
}

function showRefusal(text) {
  Object.assign(state, { found: { refusal: text }, isOld: true });
  drawBlow(true);
  showResult(state.found, state.pinned?.found, state.imperial);
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
  for (const [key] of CURVES) state.curves[key] = curveOf(scene, key);
  state.asked += 1;
  part("result").classList.add("waiting");
  fade(true); // until the next picture
  if (pool) send();
  clearTimeout(waiting);
  waiting = setTimeout(() => history.replaceState(null, "", `#${scene.link()}`), ADDRESS_WAITS);
}

function send() {
  const id = state.asked;
  state.began = performance.now();
  pool.wish(id);
  answer(id, state.scene).catch(error => {
    if (error instanceof Overtaken || id !== state.asked) return;
    state.shown = id;
    showRefusal(String(error?.message ?? error));
  });
}

// All that is told of a scene: the rate first, then its errors and a picture, then what takes longer.
async function answer(id, scene) {
  const { whole } = scene, { known, engine } = judge, job = (work, more, told) => pool.run(id, { work, scene: whole, ...more }, told);
  const changed = changes => ({ scene: engine.changed(whole, changes) });
  const others = [], coarse = [];
  let settled, plan;
  const compare = grid => { // in time: where blows do not repeat other grids take as long
    plan = judge.coarser(whole, grid);
    for (const changes of plan?.all ?? []) {
      coarse.push(new Promise((done, fail) => { others.push(job("coarse", changed(changes), done)); others.at(-1).catch(fail); }));
      coarse.at(-1).catch(() => {});
    }
  };
  const rest = await job("settle", { mostTime: MOST_TIME, tooLong: fill(WORDS.tooLong, { seconds: MOST_TIME / 1000 }), fewest: known.fewest }, told => {
    settled = told.settled;
    showRate(id, settled ?? { kind: "settling", order: 0, blows: told.soFar });
    if (told.grid && !state.found.undamped) compare(told.grid);
  });
  const found = { ...settled, ...rest }, hasRate = found.kind !== "stalled" && state.found.rate !== 0 && !state.found.undamped;
  if (hasRate && plan === undefined) compare(found.grid);
  pool.ends(found.end);
  const errors = hasRate ? judge.gridErrors(whole, found, plan, coarse, changes => job("run", { ...changed(changes), end: found.end })) : {};
  if (found.kind !== "stalled") state.found.notes.push(...notesOf(scene, state.found, rest.last, tables.notes));
  const told = [Promise.resolve(errors).then(grid => {
    if (id !== state.asked) return;
    state.found.errors = hasRate ? addVolume(judge.errors(found, state.found.counted, grid)) : {};
    show();
  }), Promise.allSettled(pool.hasRoom ? [] : [errors]).then(() => drawNext(job, scene, found))]; // where cores are few, errors come first
  await Promise.all(told);
  const motions = await Promise.all(others);
  if (motions.length && !state.found.undamped) state.found.same = motions.every(one => one.kind === found.kind && one.order === found.order);
  show();
  const curves = all => Promise.all(CURVES.map(([key]) => drawCurve(job, key, all[key])));
  await Promise.all([curves(state.curves), tellInterval(job, scene)]);
  if (state.pinned) await curves(state.pinned.curves);
}

function show() { showResult(state.found, state.pinned?.found, state.imperial); }

function showRate(id, found) {
  const { scene } = state, waits = intervalOf(scene), counted = judge.counted(found), values = found.kind === "stalled" || !counted.length ? {} : judge.values(counted);
  const rate = found.rate ?? values[RATE];
  state.found = {
    ...found, rate: Math.abs(rate) < LEAST_RATE ? 0 : rate, counted, means: addVolume(addTorque(values, counted)), rock: scene.get("effects.rock"), stiffness: scene.get("rock.loading_stiffness") * scene.get("rock.buttons"),
    still: scene.get("effects.rotation") && counted.every(one => one.rotation_index < STILL), undamped: !scene.get("effects.loss") || scene.get("loss.time") === 0,
    notes: unusual(scene, tables.notes), interval: waits ? fill(WORDS.rockWaiting, { done: 0, count: waits.samples.length }) : scene.get("effects.breaking") ? WORDS.rockOwn : WORDS.rockMissing,
  };
  Object.assign(state, { shown: id, took: performance.now() - state.began });
  drawCurves();
  show();
}

// The next blow at full rate.
async function drawNext(job, scene, { state: moving, all }) {
  const transits = scene.bars.map(transit);
  const found = await job("picture", { state: moving, busy: 1.6 * tables.transits * Math.max(...transits), transit: Math.min(...transits) });
  state.isOld = !found;
  if (found) state.blow = { ...prepared(found, scene), number: all.length + found.number, at: found.at };
  drawBlow(true);
}

// Rates over a setting: at even places, then where the curve bends.
async function drawCurve(job, key, curve) {
  if (key === "rotation.speed" && !curve.scene.get("effects.rotation")) return;
  const { engine } = judge, whole = curve.scene.whole;
  const find = places => Promise.all(places.map(async x => {
    curve.points.push([x, await job("rate", { scene: engine.changed(whole, { [key]: x }), scatter: CURVE_SCATTER })]);
    curve.points.sort(([one], [other]) => one - other);
    drawCurves(key);
  }));
  let places = curve.places.filter(x => !curve.points.some(([known]) => known === x));
  do await find(places); while (curve.points.length < MOST_POINTS && (places = bends(curve).slice(0, MOST_POINTS - curve.points.length)).length);
}

// Middles of stretches beside points that lie off the line between their neighbours.
function bends({ points, low, high }) {
  const rates = points.map(([, y]) => y || 0), most = Math.max(...rates), found = new Set();
  const middle = k => points[k + 1][0] - points[k][0] > LEAST_STRETCH * (high - low) && found.add(0.5 * (points[k][0] + points[k + 1][0]));
  for (let k = 1; k + 1 < points.length; k++) {
    const [[x], [y], [z]] = [points[k - 1], points[k], points[k + 1]], line = rates[k - 1] + (y - x) / (z - x) * (rates[k + 1] - rates[k - 1]);
    if (Math.abs(rates[k] - line) > BEND * most) [k - 1, k].forEach(middle);
  }
  return [...found];
}

// How far the rate lies off where rock and bit are others within what is known of them, by runs of
// rigid bodies where there are no rods (analysis/rock_interval.py).
async function tellInterval(job, scene) {
  const known = intervalOf(scene), { engine, known: { numbers } } = judge, { duration, settle, ends } = tables.interval;
  if (!known) return;
  const rigid = known.isString ? {} : { "piston.model": "rigid", "bit.model": "rigid" }, count = known.samples.length;
  const sample = values => job("sample", { scene: engine.changed(scene.whole, { ...values, ...rigid }), settle, end: duration, numbers: { [RATE]: numbers[RATE] } });
  let done = 0, looked = performance.now();
  const [own, ...found] = await Promise.all([{}, ...known.samples].map(async values => {
    const rate = await sample(values);
    done += 1;
    if (performance.now() - looked < TOLD) return rate;
    looked = performance.now();
    state.found.interval = fill(WORDS.rockWaiting, { done: Math.min(done, count), count });
    show();
    return rate;
  }));
  const shares = found.map(one => one / own).filter(Number.isFinite).sort((a, b) => a - b);
  if (!shares.length || !(own > 0)) return;
  const at = share => {
    const place = share * (shares.length - 1), k = Math.floor(place);
    return shares[k] + (place - k) * ((shares[k + 1] ?? shares[k]) - shares[k]);
  };
  state.found.interval = { rock: shorter(tables.rocks[scene.rock].title), ends: [at(ends), at(1 - ends)] };
  show();
}

// Points of a curve that are to be found; those of the curve before where only its own setting has moved.
function curveOf(scene, key) {
  const slider = SLIDERS.find(one => one.key === key), value = scene.get(key);
  const low = Math.min(slider.low, value), high = Math.max(slider.high, value), { [key]: _, ...others } = scene.values;
  const of = JSON.stringify([scene.hammer, scene.bit, scene.rock, others, low, high]), before = state.curves[key];
  if (before?.of === of) return before;
  return { of, scene, low, high, places: Array.from({ length: POINTS }, (_, k) => low + k / (POINTS - 1) * (high - low)), points: [] };
}

function addTorque(numbers, blows) {
  if (blows.length && state.scene.get("effects.rotation")) numbers.rotation_torque = blows.reduce((sum, one) => sum + one.rotation_torque, 0) / blows.length;
  return numbers;
}

// Specific energy beside the energy by advance, where the hole is known.
function addVolume(numbers) {
  const hole = state.scene.get("hole_diameter");
  if (hole > 0) numbers.specific_energy = numbers.energy_per_advance / (0.25 * Math.PI * hole * hole);
  return numbers;
}

// ---- what is drawn

const range = () => stretch(state.blow, part("view").value === "blow");

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
  if (first && !matchMedia("(prefers-reduced-motion: reduce)").matches) { if (STAGE) player.play(true); else player.playOnce(); }
  part("which").textContent = fill(WORDS.which, { n: state.blow.number, at: state.blow.at.toPrecision(4) });
  figures.describe();
}

function drawCurves(only) {
  part("turning").hidden = !state.scene.get("effects.rotation");
  for (const [key, plot, kind, name] of CURVES) {
    if ((only && only !== key) || (key === "rotation.speed" && part("turning").hidden)) continue;
    figures.drawRates(figures[plot], state.curves[key], state.pinned?.curves[key], [state.scene.get(key), state.found?.rate], kind, name, state.imperial);
  }
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
  // The address is written a while after a change: by now it may be another than the one that was asked.
  window.addEventListener("hashchange", event => start(new URL(event.newURL).hash));
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

// Within another page: the drill at work alone.
document.body.classList.toggle("stage-only", STAGE);
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
globalThis.explorer = { state, tables, player, judge: () => judge, change: values => change(state.scene.with(values)), show: change, Scene };
startEngine().catch(error => fail(String(error?.message ?? error)));
