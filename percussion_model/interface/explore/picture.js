// One blow at full rate: what a sample has, and the stress in both bars.
const STEPS = 24, BUSY_SAMPLES = 1600, QUIET_SAMPLES = 500, BEFORE = 0.02, PATIENCE = 4, PIECE = 200, MOST_COLUMNS = 1000;

// The next whole blow of a motion; null where there is none.
export async function picture(motion, { scene, busy: longest, transit }, keep) {
  const { state } = motion, { time: begin } = state;
  motion.runBlows(2, begin + PATIENCE);
  const blow = motion.blows.length > 1 ? motion.blows.at(-1) : null;
  if (!blow) return null;
  const busy = Math.min(blow.period, longest), start = Math.max(blow.time - BEFORE * blow.period, begin);
  const even = (from, length, many) => Array.from({ length: many }, (_, k) => from + k / many * length);
  const times = [...even(start, blow.time - start, 20), ...even(blow.time, busy, BUSY_SAMPLES),
    ...(busy < blow.period ? even(blow.time + busy, blow.period - busy, QUIET_SAMPLES) : []), blow.time + blow.period];
  const { length: number } = motion.blows;
  motion.state = state;
  const columns = await sampled(motion, times, keep);
  motion.state = state;
  const fields = await stresses(motion, scene, blow, times, busy, Math.max(transit / STEPS, busy / MOST_COLUMNS), keep);
  return { time: Float64Array.from(times, t => t - blow.time), columns, fields, period: blow.period, busy, number, at: blow.time };
}

// Samples in pieces.
async function sampled(motion, times, keep) {
  const columns = {};
  for (let done = 0; done < times.length; done += PIECE) {
    for (const [name, values] of Object.entries(motion.sample(times.slice(done, done + PIECE)))) {
      columns[name] ??= new Float64Array(times.length);
      columns[name].set(values, done);
    }
    await keep();
  }
  return columns;
}

// Stress at some of the times: all steps of a wave while it is busy, few later.
async function stresses(motion, scene, blow, times, busy, step, keep) {
  let next = -Infinity, count = 0;
  const chosen = times.filter(t => t >= next && (next = t + (t < blow.time + busy ? step : 0)) > -Infinity);
  const found = new Map();
  for (const t of chosen) {
    for (const [bar, { place, force, velocity }] of Object.entries(motion.fields(t))) {
      if (!found.has(bar)) found.set(bar, { ...numbered(scene, bar), ...cellsOf(sectionsOf(scene, bar), place), time: new Float64Array(chosen.length), kinetic: new Float64Array(chosen.length), stress: new Float32Array(chosen.length * place.length) });
      const { areas, masses, time, kinetic, stress } = found.get(bar);
      kinetic[count] = velocity.reduce((sum, one, cell) => sum + 0.5 * masses[cell] * one * one, 0);
      time[count] = t - blow.time;
      stress.set(force.map((one, cell) => one / areas[cell]), count * place.length);
    }
    count += 1;
    await keep();
  }
  return [...found.values()];
}

// Number of a bar from the top.
function numbered({ rods }, bar) {
  return { bar: bar === "piston" ? 0 : bar.startsWith("rod ") ? Number(bar.slice(4)) : rods.length + 1 };
}

// Sections of a bar: "piston", "rod 1", ..., "bit".
function sectionsOf(scene, bar) {
  return bar.startsWith("rod ") ? scene.rods[bar.slice(4) - 1].sections : scene[bar];
}

// Ends of the cells of a bar by their middles, their areas and masses.
function cellsOf(sections, middles) {
  const edges = [0], areas = [], masses = [];
  let end = 0, section = -1;
  for (const middle of middles) {
    while (middle > end && section < sections.length - 1) end += sections[++section][0];
    areas.push(sections[section][1]);
    edges.push(2 * middle - edges.at(-1));
    masses.push(sections[section][1] * sections[section][3] * (edges.at(-1) - edges.at(-2)));
  }
  return { edges: Float64Array.from(edges), areas, masses };
}
