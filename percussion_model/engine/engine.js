// The engine for pages: scenes, and motions of them (`python -m percussion_model.engine.wasm`).
//
// A scene is { values: {key: value}, piston, bit, rods } as those of `table.presets`: values that
// are not the default, in SI units; sections from top to bottom, each [length, area, Young's
// modulus, density]. Errors are those of the Python package, in its words.

const WORD = 8, FACTS = 4, SAMPLES = 512, EVENTS = 1024, BLOWS = 64, ADVANCE = 0, COMMIT = 1;
// A column of blows that are counted.
const ONES = -1;

// As in analysis/stationary.py, which tells why.
const FEWEST_SCATTERED = 64, NEXT_CHECK = 1.1, SETTLING_SHARE = 0.2, MOTOR_SETTLES = 10;
const RATE_SO_FAR = ["hole_advance", "period", [1 / 8, 1 / 4, 1 / 2], 3];

export class EngineError extends Error {}

// A function of WebAssembly whose whole numbers, most of them addresses, are BigInt there.
function plain(code, form) {
  const [result, kinds] = form.split(":");
  return (...given) => {
    const found = code(...given.map((one, k) => (kinds[k] === "w" ? BigInt(one) : one)));
    return result === "w" ? Number(found) : found;
  };
}

export class Engine {
  // source: bytes of engine.wasm, a Response with them, or the module made of them; table: content of
  // table.json
  static async load(source, table) {
    const bytes = source.arrayBuffer ? await source.arrayBuffer() : source;
    const found = await WebAssembly.instantiate(bytes, {}), instance = found.instance ?? found;
    instance.exports._initialize?.();
    return new Engine(instance.exports, table);
  }

  constructor(code, table) {
    this.table = table;
    this.memory = code.memory;
    this.rows = new Map(table.parameters.map((row) => [row.key, row]));
    this._allocate = plain(code.native_allocate, "w:w");
    this.free = plain(code.native_free, ":w");
    this._check = plain(code.scene_check_base, "w:ww");
    this._solver = plain(code.scene_solver_base, "w:w");
    this.judge = Object.fromEntries(Object.entries(table.judgement).map(([name, form]) =>
      [name, plain(code[`judge_${name}_base`], form)]));
    this.entries = {};
    for (const solver of table.solvers) {
      this.entries[solver] = {};
      for (const [name, form] of Object.entries(table.entries)) {
        this.entries[solver][name] = plain(code[`${solver}_${name}_base`], form);
      }
    }
  }

  // Zeros; the address.
  allocate(words) {
    const found = this._allocate(WORD * words);
    if (found === 0) throw new EngineError(this.table.faults[this.table.fault.memory]);
    return found;
  }

  // Views are short-lived: memory that grows leaves them empty.
  numbers(address, count) {
    return new Float64Array(this.memory.buffer, address, count);
  }

  words(address, count) {
    return new BigInt64Array(this.memory.buffer, address, count);
  }

  // --- scenes

  value(scene, key) {
    return scene.values?.[key] ?? this.rows.get(key).default;
  }

  // Whether a parameter has any influence on a scene.
  matters(scene, key) {
    return matters(this.rows, (one) => this.value(scene, one), key);
  }

  // Bars between piston and bit, where they are on.
  rods(scene) {
    return this.value(scene, "effects.string") ? (scene.rods ?? []) : [];
  }

  // The scene with other values.
  changed(scene, values) {
    return { ...scene, values: { ...scene.values, ...values } };
  }

  // The scene on a rock, for the bit that is named, or for that of the rock's numbers.
  onRock(scene, rock, bit = scene.bit_name) {
    return this.changed(scene, this.table.rocks[rock].under[bit ?? ""]);
  }

  withBit(scene, bit) {
    return { ...this.changed(scene, this.table.bits[bit].values), bit_name: bit };
  }

  // All numbers of a scene as the engine takes them, in a BigInt64Array.
  image(scene) {
    const { reference } = this.table.presets;
    const { own, pressed, force, drive, counts: head } = this.table.image;
    const { piston = reference.piston, bit = reference.bit } = scene;
    const rods = this.rods(scene);
    const counts = [piston.length, bit.length, rods.length, ...rods.map((rod) => rod.sections.length)];
    const parts = [...piston, ...bit, ...rods.flatMap((rod) => rod.sections), ...rods.map((rod) => rod.joint)];
    const tail = parts.flat(), first = head + rods.length, rows = this.table.parameters;
    const size = first + rows.length + tail.length, length = Object.keys(own).length;
    const numbers = new Float64Array(size + length), words = new BigInt64Array(numbers.buffer);
    counts.forEach((count, k) => (words[k] = BigInt(count)));
    for (const row of rows) {
      let value = this.value(scene, row.key);
      if (row.kind === "choice") value = row.choices.indexOf(value);
      if (row.whole) words[first + row.word] = BigInt(value);
      else numbers[first + row.word] = value ?? NaN;
    }
    numbers.set(tail, first + rows.length);
    const law = pressed.find(([choice]) => BigInt(choice) === words[first + drive]);
    numbers[size + own.pressure] = numbers[first + (law ? law[1] : force)];
    numbers[size + own.on] = numbers[size + own.area] = 1;
    numbers[size + own.gauge_place] = -1;
    numbers[size + own.barrier_given] = scene.values?.["effects.barrier"] == null ? 0 : 1;
    return words;
  }

  // Name of the solver of a scene: "modal", "wave", "rigid"; "" for one that is not here.
  solver(scene) {
    return this.withImage(scene, (image) => this._kind(this._solver(image)));
  }

  // Why a scene cannot be computed, in the words of the package; "" if it can.
  refuse(scene) {
    const found = this._outOfBounds(scene);
    if (found.length) return found.join("\n");
    return this.withImage(scene, (image, facts) => {
      let fault = this._check(image, facts);
      if (fault === 0) {
        const solver = this._kind(this._solver(image));
        fault = solver ? this.entries[solver].refuse(image, facts) : this.table.fault.solver;
      }
      return fault ? this.faultText(fault, this.numbers(facts, FACTS)) : "";
    });
  }

  // A motion of a scene at time zero. gauge: { bar: "piston" or "bit", place: [m] } for `stress`.
  create(scene, gauge) {
    const refused = this.refuse(scene);
    if (refused) throw new EngineError(refused);
    return new Motion(this, scene, gauge);
  }

  faultText(fault, facts) {
    return this.table.faults[fault].replace(/\{(\d)(?::([^{}]*))?\}/g, (_, k, form) =>
      written(facts[k], form ?? ""));
  }

  // --- numbers over blows and their errors, as physics/judgement.py has them

  // Rows of lists of blows in memory, for as long as a function uses their addresses.
  withBlows(lists, use) {
    const { bytes: { blow: bytes }, columns: { blow: columns } } = this.table, width = bytes / WORD;
    const addresses = lists.map((blows) => this.allocate(Math.max(blows.length, 1) * width));
    lists.forEach((blows, i) => {
      const numbers = this.numbers(addresses[i], blows.length * width), words = this.words(addresses[i], blows.length * width);
      blows.forEach((one, k) => columns.forEach(({ name, word, whole }) => {
        if (whole) words[k * width + word] = BigInt(one[name]);
        else numbers[k * width + word] = one[name];
      }));
    });
    try {
      return use(addresses);
    } finally {
      addresses.forEach((address) => this.free(address));
    }
  }

  // Numbers over blows by name: value, scatter, and how far kinds of blows are apart. Wanted by name:
  // two columns whose sums are divided ("one": of ones), stretches, and fewest blows.
  numbersOver(blows, wanted) {
    const words = { ...Object.fromEntries(this.table.columns.blow.map(({ name, word }) => [name, word])), one: ONES };
    return this.withBlows([blows], ([rows]) => this.withNumbers(8, (room) =>
      Object.fromEntries(Object.entries(wanted).map(([name, [over, under, stretches, least]]) => {
        this.numbers(room, 3 + stretches.length).set(stretches, 3);
        this.judge.number(rows, blows.length, words[over], words[under], room + 3 * WORD, stretches.length, least, room);
        const [value, scatter, apart] = this.numbers(room, 3);
        return [name, { value, scatter, apart }];
      }))));
  }

  // Give room for numbers to a function.
  withNumbers(count, use) {
    const room = this.allocate(count);
    try {
      return use(room);
    } finally {
      this.free(room);
    }
  }

  _kind(number) {
    return this.table.solvers.find((name) => this.table.kinds[name] === number) ?? "";
  }

  // Give an image and room for facts to a function, for as long as it runs.
  withImage(scene, use) {
    const image = this.image(scene), address = this.allocate(image.length + FACTS);
    this.words(address, image.length).set(image);
    try {
      return use(address, address + WORD * image.length);
    } finally {
      this.free(address);
    }
  }

  // What is wrong with single values.
  _outOfBounds(scene) {
    const found = [], look = (row, key, value) => {
      if (!allowed(row, value)) found.push(`${key} = ${shown(row, value)}: must be ${row.allowed}`);
    };
    for (const [key, value] of Object.entries(scene.values ?? {})) {
      if (this.rows.has(key)) look(this.rows.get(key), key, value);
      else found.push(`unknown key ${key}`);
    }
    for (const bar of ["piston", "bit"]) {
      (scene[bar] ?? []).forEach((section, k) => this.table.section.forEach((row, i) =>
        look(row, `${bar}.sections.${k}.${row.key}`, section[i])));
    }
    return found;
  }
}

// Whether a parameter has any influence, by the values of those that it needs.
export function matters(rows, get, key) {
  return Object.entries(rows.get(key).needs).every(([need, values]) => values.includes(get(need)));
}

// --- values in words, as Python writes them

export function allowed(row, value) {
  if (value === null) return !row.required; // as the default
  if (row.kind === "flag") return typeof value === "boolean";
  if (row.kind === "choice") return row.choices.includes(value);
  if (!Number.isFinite(value) || (row.kind === "whole number" && !Number.isInteger(value))) return false;
  const low = row.lower === null || value > row.lower || (value === row.lower && !row.lowerOpen);
  return low && (row.upper === null || value < row.upper || (value === row.upper && !row.upperOpen));
}

export function shown(row, value) {
  if (typeof value !== "number") return JSON.stringify(value);
  const unit = ["", "-"].includes(row.unit) ? "" : ` ${row.unit}`;
  const isWhole = row.kind === "whole number" || row.kind === "choice";
  return (isWhole && Number.isInteger(value) ? String(value) : repr(value)) + unit;
}

const exponent = (power) => `e${power < 0 ? "-" : "+"}${String(Math.abs(power)).padStart(2, "0")}`;

// The shortest digits that tell a number from all others.
function repr(value) {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "nan" : value > 0 ? "inf" : "-inf";
  const [digits, power] = value.toExponential().split("e");
  if (value !== 0 && (power < -4 || power >= 16)) return digits + exponent(Number(power));
  const text = value.toFixed(Math.max(0, digits.replace(/[-.]/g, "").length - 1 - power));
  const sign = Object.is(value, -0) ? "-" : "";
  return sign + (text.includes(".") ? text : `${text}.0`);
}

// As the format g, of so many digits.
function general(value, count) {
  const [digits, power] = value.toExponential(count - 1).split("e");
  const short = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
  if (power < -4 || power >= count) return short(digits) + exponent(Number(power));
  return short(value.toFixed(count - 1 - power));
}

export function written(value, form) {
  if (form.startsWith("|")) return form.slice(1, -1).split("|")[Math.round(value) - 1];
  if (form === "d") return String(Math.trunc(value));
  if (form === "r") return repr(value);
  return general(value, Number(/^\.(\d+)g$/.exec(form)?.[1] ?? 6));
}

// --- motions

export class Motion {
  constructor(engine, scene, gauge) {
    Object.assign(this, { engine, scene, time: 0, blows: [], recordsEvents: false, _found: [], _owned: [], _cells: {} });
    this.solver = engine.solver(scene);
    this.entries = engine.entries[this.solver];
    try {
      this._make(engine.image(scene), gauge);
    } catch (error) {
      this.free();
      throw error;
    }
  }

  _make(image, gauge) {
    const { engine } = this, { gauge_bars: bars, head: words, bytes, columns } = engine.table;
    const [, bar, sections] = this._bars().find(([name]) => name === gauge?.bar) ?? [, bars.none, []];
    const length = sections.reduce((sum, [own]) => sum + own, 0);
    if (gauge?.place > length && sections.length) {
      throw new EngineError(engine.faultText(engine.table.fault.gauge, [gauge.place, length, bar]));
    }
    this._hasGauge = sections.length > 0;
    this._image = this._own(image.length);
    engine.words(this._image, image.length).set(image);
    this.base = this.entries.create(this._image, bar, gauge?.place ?? 0, 0);
    if (this.base === 0) throw new EngineError(engine.faultText(engine.table.fault.memory, []));
    this._owned.push(this.base);
    const head = (name) => Number(engine.words(this.base, 1 + words[name])[words[name]]);
    this.moving = this.base + head("state_at");
    this._size = head("state_bytes") / WORD;
    this._counts = [head("blow_count_at"), head("event_count_at")];
    this._copy = this._own(this._size);
    this._ahead = this._own(this._size);
    this._blows = this._own((BLOWS * bytes.blow) / WORD);
    this._events = this._own((EVENTS * bytes.event) / WORD);
    this._reading = this._own(bytes.reading / WORD);
    this._times = this._own(SAMPLES);
    this._rows = this._own(SAMPLES * columns.sample.length);
    this._done = this._own(1);
  }

  // In the order of time; none where `recordsEvents` was not set before.
  get events() {
    return this._found.sort((one, other) => one.time - other.time);
  }

  _own(words) {
    this._owned.push(this.engine.allocate(words));
    return this._owned.at(-1);
  }

  // Give the memory back; nothing else may be called afterwards.
  free() {
    this._owned.splice(0).forEach((address) => this.engine.free(address));
  }

  // Advance to a time [s].
  runUntil(t) {
    this._mayGoTo(t);
    this._advance(t);
    this.time = t;
    return this;
  }

  // Advance until so many more blows have ended, or to a time [s].
  runBlows(count, t) {
    this._mayGoTo(t);
    while (count > 0) {
      let { status, blows } = this._run(this.moving, ADVANCE, t, Math.min(count, BLOWS));
      if (status === 0 && blows < count) {
        const ahead = this._findBlow(t);
        if (ahead === null) break;
        blows += ahead;
      }
      count -= blows;
    }
    const reached = count > 0 ? t : this.entries.state_time(this.base, this.moving);
    this.time = Math.max(this.time, reached);
    return this;
  }

  // Advance through rising times, and read at each: columns by name, of `table.columns.sample`.
  sample(times) {
    const { engine } = this, columns = engine.table.columns.sample, width = columns.length;
    const rows = new Float64Array(times.length * width);
    for (let done = 0; done < times.length; ) {
      this.runUntil(times[done]);
      const count = Math.min(times.length - done, SAMPLES);
      engine.numbers(this._times, count).set(times.slice(done, done + count));
      const status = this.entries.sample(
        this.base, this.moving, this._copy, 1, this._times, count, this._reading, this._rows,
        this._blows, BLOWS, this._events, EVENTS, this.recordsEvents ? 1 : 0, this._done);
      this._take(status, this.moving);
      const filled = Number(engine.words(this._done, 1)[0]);
      rows.set(engine.numbers(this._rows, filled * width), done * width);
      done += filled;
    }
    if (times.length) this.runUntil(times.at(-1));
    const column = (k) => Float64Array.from(times, (t, i) => (k === 0 ? t : rows[i * width + k]));
    return Object.fromEntries(columns.map(({ name }, k) => [name, column(k)]));
  }

  // Advance through rising times: stress at the gauge at each [Pa].
  stress(times) {
    if (!this._hasGauge) throw new EngineError("no gauge is on an elastic bar: create the motion with one");
    return Float64Array.from(times, (t) => this.entries.stress(this.base, this._seen(t)));
  }

  // Advance to a time: elastic force [N] and velocity [m/s] of each cell, at places of their middle
  // from the top [m], by the names of elastic bars: "piston", "rod 1", ..., "bit".
  fields(t) {
    const at = this._seen(t), { engine } = this, found = {};
    for (const [name, bar, sections] of this._bars()) {
      const form = this.entries.shape_form(this.base, at, bar), key = `${name} ${form}`;
      const { n, masses, made, modes, place } = this._cells[key] ??= this._cellsOf(bar, form, sections);
      const force = masses + n * WORD, velocity = force + n * WORD;
      this.entries.fields(this.base, at, bar, masses, made, modes, n, force, velocity);
      const [forces, velocities] = [force, velocity].map((from) => engine.numbers(from, n).slice());
      found[name] = { place: place.slice(), force: forces, velocity: velocities };
    }
    return found;
  }

  // Cells of a bar and the shapes of its modes, with room for its fields.
  _cellsOf(bar, form, sections) {
    const n = this.entries.cells(this._image, bar, 0, 0), modes = this.entries.shapes(this._image, bar, form, 0);
    const room = this._own(sections.length + n * (3 + 2 * modes));
    const masses = room + sections.length * WORD, made = masses + 3 * n * WORD;
    this.entries.cells(this._image, bar, room, masses);
    this.entries.shapes(this._image, bar, form, made);
    const counts = Array.from(this.engine.words(room, sections.length), Number);
    const lengths = counts.flatMap((count, k) => Array(count).fill(sections[k][0] / count));
    let top = 0;
    const place = Float64Array.from(lengths, (length) => (top += length) - 0.5 * length);
    return { n, masses, made, modes, place };
  }

  // Run from time zero until blows repeat within a tolerance, or so many have ended, or their rate is
  // known to a scatter (0: never): { kind, order, rate, error, multiplier } as of `settled` in Python.
  settle(tolerance = 1e-4, mostBlows = 400, scatter = 0) {
    return this.settling(tolerance, mostBlows, scatter, Infinity).next().value;
  }

  // The same as a generator, which yields after each piece of time [s], and returns what `settle` does.
  *settling(tolerance, mostBlows, scatter, piece) {
    const { engine } = this, { request: place, verdicts, bytes, columns, status: names } = engine.table;
    const value = (key) => engine.value(this.scene, key);
    if (value("piston.model") === "absent") {
      throw new EngineError('piston.model = "absent": a bit alone has no blows that could settle');
    }
    const stalls = value("effects.rotation") && value("rotation.stall_torque") > 0;
    const width = bytes.blow / WORD, size = Object.keys(place).length;
    const asked = engine.allocate(size + mostBlows * width), rows = asked + size * WORD;
    const numbers = () => engine.numbers(asked, size), words = () => engine.words(asked, size);
    const [first, given] = [numbers(), words()];
    first[place.tolerance] = tolerance;
    first[place.not_before] = stalls ? MOTOR_SETTLES * value("rotation.response") : 0;
    first[place.enough] = scatter ? FEWEST_SCATTERED : Infinity;
    given[place.most] = BigInt(mostBlows);
    try {
      for (;;) {
        numbers()[place.until] = this.time + piece;
        const status = this.entries.settle(this.base, this.moving, asked, rows, mostBlows);
        if (status !== names.done) this._fail(status, this.moving);
        const found = numbers(), whole = (name) => Number(words()[place[name]]), listed = this.blows.length;
        this.time = found[place.time];
        this._list(rows + listed * bytes.blow, whole("blows") - listed, columns.blow, bytes.blow, this.blows);
        const verdict = whole("verdict");
        if (verdict === verdicts.open) {
          yield;
          continue;
        }
        const none = { order: 0, rate: NaN, error: NaN, multiplier: NaN };
        if (verdict === verdicts.stalled) return { kind: "stalled", ...none };
        if (verdict === verdicts.periodic) {
          const [rate, error, multiplier] = ["rate", "error", "multiplier"].map((name) => found[place[name]]);
          return { kind: "periodic", order: whole("order"), rate, error, multiplier };
        }
        const counted = this.blows.slice(Math.trunc(SETTLING_SHARE * this.blows.length));
        const { value: rate, scatter: error } = engine.numbersOver(counted, { rate: RATE_SO_FAR }).rate, known = { rate, error };
        if (this.blows.length >= mostBlows || known.error <= scatter * Math.abs(known.rate)) {
          return { kind: "aperiodic", ...none, ...known };
        }
        words()[place.verdict] = 0n;
        found[place.enough] = NEXT_CHECK * this.blows.length;
      }
    } finally {
      engine.free(asked);
    }
  }

  // What it is divided by: the number of the kind of grid, and modes or steps in the first elastic bar.
  grid() {
    const { engine: { table: { grids }, judge: judge } } = this, [[name, bar] = []] = this._bars();
    if (this.solver === "modal") return [grids.modes, judge.modes(this.base, name === "piston" ? 1 : 0)];
    if (this.solver === "wave") return [grids.steps, this.entries.cells(this._image, bar, 0, 0)];
    return [grids.none, 1];
  }

  // Share of the energy put in that the discretisation took.
  numericalShare() {
    const { bytes, energies } = this.engine.table;
    this._seen(this.time);
    return this.engine.judge.numerical(this._reading + bytes.reading - energies * WORD, energies);
  }

  // All that moves, and its time, to go on from in another motion of the same scene.
  get state() {
    return { words: this.engine.words(this.moving, this._size).slice(), time: this.time };
  }

  set state({ words, time }) {
    this.engine.words(this.moving, this._size).set(words);
    this.time = time;
  }

  // Change inputs at the next grid point, by the keys of `table.inputs` [SI].
  set(values) {
    let t = this.entries.grid_point_after(this.base, this.moving, this.time);
    for (let reached = -Infinity; t > reached; ) { // a step that is cut moves the grid
      this._advance(t);
      reached = t;
      t = this.entries.grid_point_after(this.base, this.moving, this.time);
    }
    while (this._run(this.moving, COMMIT, t, BLOWS).status !== 0);
    for (const [key, value] of Object.entries(values)) {
      const word = this.engine.table.inputs[key].words[this.solver];
      this.engine.numbers(this.moving + this.engine.table.bytes.record, word + 1)[word] = value;
    }
    return this;
  }

  // Elastic bars from top to bottom: name, number and sections.
  _bars() {
    if (this.solver === "rigid") return [];
    const { engine, scene } = this, { gauge_bars: numbers, presets: { reference } } = engine.table;
    const isElastic = engine.value(scene, "piston.model") === "elastic";
    return [
      ...(isElastic ? [["piston", numbers.piston, scene.piston ?? reference.piston]] : []),
      ...engine.rods(scene).map((rod, k) => [`rod ${k + 1}`, numbers.rod + k, rod.sections]),
      ["bit", numbers.bit, scene.bit ?? reference.bit],
    ];
  }

  _mayGoTo(t) {
    if (!Number.isFinite(t)) throw new EngineError(`t = ${repr(t)}: must be a finite time in s`);
    if (t >= this.time) return;
    throw new EngineError(`t = ${repr(t)} s: lies before the present time ${repr(this.time)} s`);
  }

  _advance(t) {
    do {
      while (this._run(this.moving, ADVANCE, t, BLOWS).status !== 0);
    } while (this._findBlow(t) !== null);
  }

  // Address of the state at a time, read.
  _seen(t) {
    this.runUntil(t);
    t = Math.max(t, this.entries.state_time(this.base, this.moving));
    this.entries.read(this.base, this.moving, this._copy, t, this._reading, 0);
    return this.solver === "wave" ? this.moving : this._copy; // reading leaves waves alone
  }

  // Do what is pending at a time if it ends before, as at a blow; blows that ended, null: nothing.
  _findBlow(t) {
    const end = this.entries.time_of_blow(this.base, this.moving), { engine, _size: size } = this;
    if (!(end > t)) return null;
    const copy = (from, to) => engine.words(to, size).set(engine.words(from, size));
    copy(this.moving, this._ahead);
    const status = this._call(this._ahead, ADVANCE, end, 1);
    const before = this.entries.state_time(this.base, this.moving);
    const now = this.entries.state_time(this.base, this._ahead);
    if (now > t) return null;
    copy(this._ahead, this.moving);
    const { blows } = this._take(status, this.moving);
    return now > before || blows > 0 ? blows : null;
  }

  _call(moving, task, t, room) {
    return this.entries.run(this.base, moving, task, t, this._blows, room, this._events, EVENTS,
      this.recordsEvents ? 1 : 0);
  }

  _run(moving, task, t, room) {
    return this._take(this._call(moving, task, t, room), moving);
  }

  // Keep the rows of a call.
  _take(status, moving) {
    const { table } = this.engine, begin = table.bytes.record;
    const record = this.engine.words(moving + begin, this._size - begin / WORD);
    const [blows, events] = this._counts.map((word) => Number(record[word]));
    this._list(this._blows, blows, table.columns.blow, table.bytes.blow, this.blows);
    this._list(this._events, events, table.columns.event, table.bytes.event, this._found);
    const names = table.status;
    const isFull = status === names.blows_full || status === names.events_full;
    if (status === 0 || (isFull && blows + events > 0)) return { status, blows };
    return this._fail(status, moving);
  }

  _fail(status, moving) {
    const { status: names, fault } = this.engine.table;
    const number = status === names.not_finite ? fault.not_finite : fault.stopped;
    throw new EngineError(this.engine.faultText(number, [this.entries.state_time(this.base, moving)]));
  }

  _list(address, count, columns, bytes, list) {
    for (let k = 0; k < count; k++) {
      const numbers = this.engine.numbers(address + k * bytes, bytes / WORD);
      const words = this.engine.words(address + k * bytes, bytes / WORD);
      list.push(Object.fromEntries(columns.map(({ name, word, whole }) =>
        [name, whole ? Number(words[word]) : numbers[word]])));
    }
  }
}
