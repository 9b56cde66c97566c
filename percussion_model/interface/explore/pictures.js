// Small pictures of hammers, bits and rocks, drawn from their numbers.

const svg = (width, height, inside) =>
  `<svg viewBox="0 0 ${width} ${height}" aria-hidden="true" focusable="false">${inside}</svg>`;

// Numbers from 0 to 1 that look like chance, always the same for a seed.
export function chance(seed) {
  let state = seed * 2654435761 >>> 0;
  return () => {
    state = state + 0x6D2B79F5 >>> 0;
    let t = Math.imul(state ^ state >>> 15, 1 | state);
    t = t + Math.imul(t ^ t >>> 7, 61 | t) ^ t;
    return ((t ^ t >>> 14) >>> 0) / 4294967296;
  };
}

export function seedOf(text) {
  return [...text].reduce((sum, letter) => Math.imul(sum, 31) + letter.charCodeAt(0) >>> 0, 7);
}

// Piston and bit of a hammer, lying, to one scale for all; rods where there are some.
export function hammerPicture({ piston, bit, rods }, { air }) {
  if (rods.length) {
    const rods = [8, 34, 60].map(x => `<rect x="${x}" y="24" width="24" height="7" fill="var(--steel)" stroke="var(--soft)"/>`);
    return svg(112, 56, `${rods.join("")}<rect x="86" y="20" width="12" height="15" fill="var(--stone-dark)"/>`);
  }
  let x = 4, shapes = "";
  [piston, bit].forEach((bar, k) => {
    for (const [length, area] of bar) {
      const width = 118 * length, high = 280 * Math.sqrt(area / Math.PI);
      shapes += `<rect x="${x}" y="${28 - high / 2}" width="${width}" height="${high}" fill="${k ? "var(--stone-dark)" : "var(--steel)"}" stroke="var(--soft)"/>`;
      x += width;
    }
    x += 4;
  });
  const dots = air ? [14, 30, 46].map(at => `<circle cx="${at}" cy="6" r="3" fill="none" stroke="var(--accent)" stroke-width="1.5"/>`).join("") : "";
  return svg(112, 56, shapes + dots);
}

// The face of a bit with its buttons.
export function bitPicture(bit) {
  const radius = 27 * Math.min(bit.diameter / 0.216, 1) ** 0.5, inner = bit.buttons - bit.gauge;
  const ring = (count, at) => Array.from({ length: count }, (_, k) => {
    const angle = 2 * Math.PI * (k + 0.3) / count;
    return `<circle cx="${30 + at * Math.cos(angle)}" cy="${29 + at * Math.sin(angle)}" r="2.6" fill="var(--paper)" stroke="var(--soft)"/>`;
  }).join("");
  const few = Math.min(inner, 3);
  return svg(60, 58, `<circle cx="30" cy="29" r="${radius}" fill="var(--steel)" stroke="var(--soft)"/>` +
    ring(bit.gauge, radius - 4) + ring(inner - few, radius * 0.55) + ring(few, radius * 0.2));
}

// Grains of a rock: pale and dark ones, in layers where it is a sediment.
export function rockPicture(name) {
  const random = chance(seedOf(name)), layered = /sand|lime/.test(name), model = /model|hard/.test(name);
  const tint = /red/.test(name) ? "#b07a6a" : /sand/.test(name) ? "#c9ab7c" : /lime/.test(name) ? "#c8c4b4" : model ? "#9aa3ab" : "#a9a6a2";
  let grains = "";
  for (let k = 0; k < 70; k++) {
    const dark = random() < 0.4, size = layered ? 0.8 + random() : 1 + 2.6 * random();
    grains += `<ellipse cx="${(90 * random()).toFixed(1)}" cy="${(52 * random()).toFixed(1)}" rx="${(size * 1.3).toFixed(1)}" ry="${size.toFixed(1)}" fill="${dark ? "#3c3a39" : "#f3ece4"}" opacity=".6"/>`;
  }
  for (let y = 8; layered && y < 52; y += 11) grains += `<path d="M0 ${y}q22 ${6 * random() - 3} 45 0t45 0" fill="none" stroke="#6b6252" opacity=".6"/>`;
  return svg(90, 52, `<rect width="90" height="52" fill="${tint}"/>${grains}`);
}
