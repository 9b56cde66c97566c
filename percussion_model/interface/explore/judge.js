// Numbers over the blows of a settled motion, and their errors: which runs are compared. What is
// computed of them is the engine's (physics/judgement.py, analysis/stationary.py).
export const RATE = "rate_of_penetration";
const WORD = 8; // bytes of a number

// engine: with tables; known: what the catalogue has of settled motions; runs: starts a run of a scene
// in a worker, and gives a promise.
export class Judge {
  constructor(engine, known) {
    Object.assign(this, { engine, known });
  }

  // Numbers by name; NaN where blows have ceased.
  values(blows) {
    const found = this.engine.numbersOver(blows, this.known.numbers);
    return Object.fromEntries(Object.entries(found).map(([name, one]) => [name, one.value]));
  }

  // Blows of which means are taken.
  counted({ order, blows }) {
    return order ? blows.slice(-order) : blows.slice(Math.trunc(this.known.settling * blows.length));
  }

  // Changes to the scenes of coarser grids; null where none are known.
  coarser(scene, [grid, present]) {
    const { engine, known: { steps } } = this, { grids } = engine.table, longer = {};
    for (const [key, longest] of Object.entries(steps)) {
      if (engine.matters(scene, key)) longer[key] = engine.judge.longer_step(engine.value(scene, key), longest);
    }
    if (grid === grids.none) return { all: Object.keys(longer).length ? [longer] : [], usual: true };
    const counts = this.counts(scene, grid, present);
    if (!counts.length) return null;
    const all = counts.map(count => ({ ...longer, "solver.cells": count, "solver.accuracy": null }));
    if (grid === grids.modes) return { all, usual: true };
    const chosen = Math.max(all.findIndex(one => !engine.refuse(engine.changed(scene, one))), 0);
    return { all: [all[chosen]], usual: chosen === 0 };
  }

  // Errors of a motion by its grid. found: of the worker, with its grid, end and numerical share.
  // plan: as of `coarser`; coarse: promises of its runs; run: gives that of a run with changes until
  // the end: blows and grid.
  async gridErrors(scene, found, plan, coarse, run) {
    const { engine, known } = this, { end, order } = found, [grid, present] = found.grid, { grids } = engine.table;
    const names = Object.keys(known.numbers);
    if (!plan) return {};
    if (!plan.all.length) return Object.fromEntries(names.map(name => [name, 0]));
    const from = (order ? known.judged : known.settling) * end;
    const inside = one => ({ ...one, blows: one.blows.filter(blow => blow.time >= from && blow.time + blow.period <= end) });
    const own = inside({ blows: found.all, grid: found.grid }), others = (await Promise.all(coarse)).map(inside);
    const barriers = this.barriers(own.blows, others.map(one => one.blows)), barrier = engine.value(scene, "rock.barrier_threshold");
    const decided = (await Promise.all(barriers.map(factor => run({ "rock.barrier_threshold": factor * barrier })))).map(inside);
    const runs = [own, ...others, ...decided].map(({ blows, grid: [, count] }) =>
      ({ numbers: engine.numbersOver(blows, known.numbers), cycles: this.cyclesOver(blows), count }));
    const promised = grid === grids.none ? 0 : this.promised(scene, grid, present), share = plan.usual ? known.floor : 1, errors = {};
    for (const name of names) {
      const rows = runs.map(({ numbers, cycles, count }) => [numbers[name].value, numbers[name].scatter, cycles, count]), [[value]] = rows;
      if (!Number.isFinite(value) || value === 0) continue;
      const error = Math.abs(value) * this.errorOf(grid, rows, others.length, runs[0].numbers[name].apart, promised, share, found.numerical);
      if (Number.isFinite(error)) errors[name] = error;
    }
    return errors;
  }

  // The whole errors: of settling and grid.
  errors({ order, error, blows }, counted, grid) {
    const { engine, known } = this, last = this.values(counted), errors = {};
    const scatter = engine.numbersOver(counted, { ...known.numbers, ...known.settlingOf });
    const before = order && this.values(blows.slice(-2 * order, -order));
    for (const name of Object.keys(last)) {
      const settling = name === RATE ? error : order ? Math.abs(last[name] - before[name]) : scatter[name].scatter;
      const whole = order ? settling + (grid[name] ?? 0) : Math.max(settling, grid[name] ?? 0);
      errors[name] = whole < known.rounding && name !== RATE ? 0 : whole;
    }
    return errors;
  }

  // Mean drilling cycles of blows.
  cyclesOver(blows) {
    return this.engine.withBlows([blows], ([rows]) => this.engine.judge.cycles(rows, blows.length));
  }

  // Barriers, by the present one, beyond which close decisions of a run fall the other way, as runs on
  // coarser grids tell.
  barriers(blows, others) {
    const lists = [blows, ...others], count = lists.length;
    return this.engine.withBlows(lists, (addresses) => this.engine.withNumbers(2 * count + 2, (room) => {
      const words = this.engine.words(room, 2 * count);
      lists.forEach((one, k) => { words[k] = BigInt(addresses[k]); words[count + k] = BigInt(one.length); });
      const out = room + 2 * count * WORD;
      this.engine.judge.barriers(room, room + count * WORD, count, out);
      return Array.from(this.engine.numbers(out, 2)).filter(Number.isFinite);
    }));
  }

  // Relative error of a number. rows: [value, scatter, cycles, modes or steps] of the run, of so many
  // others on coarser grids, and of those with another barrier.
  errorOf(grid, rows, others, apart, promised, floorShare, numerical) {
    return this.engine.withNumbers(4 * rows.length, (room) => {
      this.engine.numbers(room, 4 * rows.length).set(rows.flat());
      return this.engine.judge.error(grid, room, rows.length, others, apart, promised, floorShare, numerical);
    });
  }

  // Modes or steps of runs to compare with, of a scene that has so many at present.
  counts(scene, grid, present) {
    return this.engine.withImage(scene, (image) => this.engine.withNumbers(present + 2, (room) =>
      Array.from(this.engine.words(room, this.engine.judge.coarser(image, grid, present, room)), Number)));
  }

  // Relative error of the rate that so many modes or steps promise.
  promised(scene, grid, present) {
    return this.engine.withImage(scene, (image) => this.engine.judge.promised(image, grid, present));
  }
}
