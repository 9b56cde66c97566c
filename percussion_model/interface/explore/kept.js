// Tables that equal scenes share, kept from wish to wish: most of the time to create a motion.

const MOST = 8, WORD = 8, ROOM = 64;

// Let an engine keep the motions whose tables others use.
export function keepTables(engine) {
  const { table } = engine, kept = new Map(), room = engine.allocate(ROOM);
  const keyOf = (solver, image) => {
    const count = engine.entries[solver].table_key(image, room);
    if (count === 0) return "";
    const head = Array.from(engine.words(image, table.image.counts), Number), first = table.image.counts + head[2];
    const sections = engine.numbers(image + WORD * (first + table.parameters.length), 4 * (head[0] + head[1]));
    const model = engine.words(image, first + table.parameters.length)[first + engine.rows.get("piston.model").word];
    return [solver, head, sections.join(), model, engine.numbers(room, count).join()].join(";");
  };
  for (const [solver, entries] of Object.entries(engine.entries)) {
    const create = entries.create;
    entries.create = (image, bar, place) => {
      const key = keyOf(solver, image);
      if (!key) return create(image, bar, place, 0);
      let like = kept.get(key);
      kept.delete(key);
      like ??= create(image, table.gauge_bars.none, 0, 0);
      if (like === 0) return 0;
      kept.set(key, like); // the last that was used
      if (kept.size > MOST) {
        const [oldest] = kept.keys();
        engine.free(kept.get(oldest));
        kept.delete(oldest);
      }
      return create(image, bar, place, like);
    };
  }
  return engine;
}
