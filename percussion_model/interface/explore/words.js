// All words of the page that do not come from the table of parameters.

export const WORDS = {
  kinds: {
    once: "Every blow is alike.",
    cycle: "The motion repeats after {n} blows.",
    aperiodic: "The blows do not repeat: numbers are means over {n} blows.",
    settling: "So far, after {n} blows; they are not yet alike.",
    stalled: "The blows have ceased: there is no rate.",
  },
  nothing: {
    bilinear: " Nothing breaks: the blows are too weak, or the feed does not hold the bit on the rock.",
    spring: " A spring gives all back: nothing breaks.",
    wall: " Nothing breaks a rigid wall.",
    still: " Nothing breaks: the bit does not turn, so its buttons meet crushed rock alone.",
    none: " Without rock nothing stops the bit, which runs away: there is no steady motion.",
  },
  undamped: " Without loss in the steel the rate depends on the resolution: it is undecided.",
  atThis: "at this resolution {value}",
  sameMotion: " A coarser computation finds the same.",
  otherMotion: " A coarser computation finds another motion: a small change may alter the result.",
  undecided: "undecided",
  numerical: "± {error} by the computation",
  noError: "error of the computation: being estimated …",
  errorUnknown: "(numerical error: not estimated here; percussion settled does)",
  rockRange: "{low} to {high} by what is known of rock and bit",
  rockError: "{rock}. Real drills differ more: without a calibration on site the rate may be off by a factor of 2 or more.",
  rockMissing: "The interval of the rate by the rock needs a bit that breaks rock: choose one.",
  rockWaiting: "Range by what is known of the rock: {done} of {count} samples …",
  rockOwn: "The rock's numbers were changed, or have no name: no range is known of them.",
  pinned: "Pinned, in grey: {rate}. {name}.",
  energyOf: "Each blow carries {blow}; {share} % of it goes into the rock, and the hole advances {advance} {unit} for it.",
  energyOfFeed: "Each blow carries {blow}. The feed does so much work besides that the rock takes {share} % of that, and the hole advances {advance} {unit} for it.",
  against: "Why another rate than pinned: blows per second × {frequency}, energy of a blow × {blow}, share into the rock × {share}, advance for the same energy in the rock × {depth}.",
  softer: " A stiffer rock is pressed in less by the same energy.",
  values: "{rock} {unit} on the rock, {piston} {unit} on the bit, {depth} {mm} deep",
  which: "Blow {n} of the run, from {at} s on.",
  all: "All {n}", fewer: "Fewer",
  oldBlow: "The pictures show the last blow that was computed.",
  copied: "Copied.",
  notCopied: "The browser lets nothing be copied: copy the text that is marked.",
  play: "Play", pause: "Pause",
  light: "Light", dark: "Dark", metric: "Metric units", imperial: "Imperial units",
  pin: "Pin to compare", unpin: "Remove pinned",
  given: "of the preset",
  tooLong: "No stationary response within {seconds} s of computing, which is the limit here: percussion settled of this scene may take longer.",
  drawn: "Piston, bit and rock in slow motion. Greatest stress {mega} MPa, greatest force on the rock {force} kN.",
  plotted: "{what}. The blow lasts {period} ms; greatest force on the rock {force} kN, greatest stress {mega} MPa.",
  crashed: "The engine has stopped at this scene ({why}). It was started anew: choose another.",
  engine: "This browser cannot run the engine: {why}",
  oldLink: "This link was made by version {theirs}; this page is version {ours}. Numbers may differ.",
  badLink: "In the link, {why}",
  notWhole: "the scene is not whole.",
  noSuch: "{key}: there is no such parameter.",
  about: "percussion_model {version}. Piston and bit are elastic bars, the rock follows a law with memory. All is computed on this machine; nothing is sent.",
  computing: "computing …",
  compression: "compression", tension: "tension",
  drive: "drive", feed: "feed", bars: ["piston", "rods", "bit"],
  magnified: "bit motion × {n}",
};

// Sliders: key of the table, name, kind of unit, where it reaches [SI], and when it is shown.
export const SLIDERS = [
  { key: "feed.force", name: "Feed", onCasing: "Feed on the casing", unit: "force", low: 0, high: 20e3 },
  { key: "drive.force", name: "Drive force on the piston", unit: "force", low: 500, high: 20e3 },
  { key: "pneumatic.supply_pressure", name: "Air pressure", unit: "pressure", low: 4e5, high: 35e5 },
  { key: "hydraulic.supply_pressure", name: "Oil pressure", unit: "pressure", low: 60e5, high: 250e5 },
  { key: "drive.reversal_distance", name: "Stroke: where the drive turns", unit: "length", low: 0.005, high: 0.1 },
  { key: "rotation.speed", name: "Rotation", unit: "turns", low: 0, high: 26.2 },
];
export const OTHERS = [
  { key: "rock.loading_stiffness", name: "Rock stiffness, loading", unit: "stiffness", low: 1e8, high: 3e9 },
  { key: "rock.unloading_ratio", name: "Ratio of unloading to loading stiffness", unit: "ratio", low: 1.1, high: 20 },
  { key: "rock.barrier_energy", name: "Energy barrier", unit: "energy", low: 0, high: 0.5 },
  { key: "breaking.crushing_energy", name: "Crushing energy", unit: "specific", low: 10e6, high: 150e6 },
  { key: "loss.time", name: "Loss time of steel", unit: "microseconds", low: 5e-8, high: 2e-6 },
  { key: "drive.external_force", name: "Given force on the piston", unit: "force", low: -20e3, high: 20e3 },
  { key: "rotation.stall_torque", name: "Torque at which the rotation stalls (0: never)", unit: "torque", low: 0, high: 3000 },
  { key: "feed.casing_mass", name: "Mass of the casing", unit: "mass", low: 0, high: 300 },
];

// Lengths of sections, from top to bottom.
export const LENGTHS = [["piston", "Piston"], ["bit", "Bit"]].flatMap(([bar, name]) => [0, 1, 2, 3, 4, 5].map(k =>
  ({ key: `${bar}.sections.${k}.length`, name: `${name}, length of section ${k + 1}`, unit: "length", low: 0.02, high: 0.5 })));

// Switches and choices: key of the table, name, and the words of its choices.
export const CHOICES = [
  { key: "effects.breaking", name: "Hole advances by the volume broken" },
  { key: "effects.rotation", name: "Bit turns" },
  { key: "effects.cuttings", name: "Cuttings stay in the crater" },
  { key: "effects.barrier", name: "Energy barrier before the rock breaks" },
  { key: "effects.loss", name: "Loss in the steel" },
  { key: "effects.gravity", name: "Weight of piston and bit" },
  { key: "effects.joints", name: "Joints of the rods" },
  { key: "effects.damper", name: "Damper on the shank" },
  { key: "effects.rock", name: "Rock law", words: { bilinear: "two straight lines", power: "power law", spring: "spring without loss", wall: "rigid wall", none: "no rock" } },
  { key: "piston.model", name: "Piston", words: { elastic: "elastic", rigid: "rigid" } },
  { key: "bit.model", name: "Bit", words: { elastic: "elastic", rigid: "rigid" } },
  { key: "feed.on", name: "Feed pushes", words: { bit: "the bit", casing: "the casing" } },
];

// Numbers beside the rate: key, name, kind of unit.
export const NUMBERS = [
  ["blow_frequency", "Blow frequency", "frequency"],
  ["impact_velocity", "Impact velocity", "speed"],
  ["transfer_efficiency", "Energy into the rock", "share"],
  ["percussive_power", "Percussive power", "power"],
  ["specific_energy", "Specific energy", "specific"],
  ["blow_period", "Blow period", "milliseconds"],
  ["rotation_torque", "Torque of the rotation", "torque"],
];

// Kinds of unit: [unit, factor from SI] metric and imperial.
const same = (unit, factor) => [[unit, factor], [unit, factor]];
export const UNITS = {
  rate: [["m/h", 3600], ["ft/h", 3600 / 0.3048]],
  slow: [["mm/s", 1e3], ["in/min", 60 / 0.0254]],
  force: [["kN", 1e-3], ["lbf", 1 / 4.4482216152605]],
  load: [["kN", 1e-3], ["klbf", 1e-3 / 4.4482216152605]],
  pressure: [["bar", 1e-5], ["psi", 1 / 6894.757293168]],
  length: [["mm", 1e3], ["in", 1 / 0.0254]],
  distance: [["m", 1], ["ft", 1 / 0.3048]],
  turns: same("rpm", 30 / Math.PI),
  stiffness: [["kN/mm", 1e-6], ["klbf/in", 1 / 175126.83524647]],
  ratio: same("", 1),
  energy: [["J", 1], ["ft·lbf", 1 / 1.3558179483314]],
  specific: [["MJ/m³", 1e-6], ["kpsi", 1 / 6894757.293168]],
  microseconds: same("µs", 1e6), milliseconds: same("ms", 1e3),
  mass: [["kg", 1], ["lb", 1 / 0.45359237]],
  frequency: same("Hz", 1),
  torque: [["N m", 1], ["lbf·ft", 1 / 1.3558179483314]],
  speed: [["m/s", 1], ["ft/s", 1 / 0.3048]],
  share: same("%", 100),
  power: [["kW", 1e-3], ["hp", 1 / 745.69987158227]],
  stress: [["MPa", 1e-6], ["kpsi", 1 / 6894757.293168]],
};

// Fill named places of a text.
export function fill(text, values) {
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name]);
}
