// The panel next to the picture: values of the daemon, modes, signals, and notices.
import { nameOf } from "./blob.js";
import { NO_LOAD } from "./motion.js";
import { modeName } from "./strips.js";

const VERDICTS = { "-1": "not judged", 0: "good", 1: "watch", 2: "outside" };

export function element(name, properties = {}, ...children) {
  const made = Object.assign(document.createElement(name), properties);
  made.append(...children);
  return made;
}

/** Returns a number with four digits and a unit. */
export function digits(value, unit = "") {
  if (value === null || value === undefined || !Number.isFinite(value)) return "unknown";
  const text = value === 0 || (Math.abs(value) >= 0.01 && Math.abs(value) < 1e5)
    ? String(Number(value.toPrecision(4))) : value.toExponential(2);
  return unit ? `${text} ${unit}` : text;
}

/** Returns the row of a verdict: verdict, cause and colour. */
function verdictRow(name, validity, cause, when = "") {
  const verdict = VERDICTS[validity] ?? String(validity);
  return [name, `${verdict}${when}${cause ? `: ${cause}` : ""}`, `verdict ${verdict}`];
}

/** Returns the row of the worst verdict of a recording; `worst` is the result of Recording.verdict. */
export function recordedVerdict(worst) {
  if (worst === null) return ["worst verdict", "no verdict, because this recording contains no STATUS"];
  return verdictRow("worst verdict", worst.verdict, worst.cause, worst.verdict > 0 ? `, first at tick ${worst.tick}` : " throughout");
}

/** Returns the rows of the status table. */
export function statusRows(body, frame, status, factor, mode, isRecorded = false) {
  const rows = [["scene", body.name]];
  if (status) rows.push(["daemon", `${status.mode}, ${status.time_mode}, ${digits(status.rate, "Hz")}`]);
  if (frame) rows.push(["tick", `${frame.tick}, ${digits(frame.time, "s")}`]);
  if (status) {
    rows.push(verdictRow("verdict", status.validity, status.validity_cause));
    if (!isRecorded && status.worst_validity > status.validity)
      rows.push(verdictRow("worst", status.worst_validity, status.worst_validity_cause, ` at tick ${status.worst_validity_tick}`));
    rows.push(["error", errorText(status)]);
    rows.push(["energy", `rigid ${digits(status.kinetic_rigid, "J")}, elastic ${digits(status.kinetic_elastic + status.potential, "J")}`]);
  }
  // recordings of freeflex run have no timings
  if (status?.window_ticks > 0) {
    rows.push(["lateness", `p50 ${digits(status.lateness_us.p50)}, p99.9 ${digits(status.lateness_us.p99_9)}, most ${digits(status.lateness_us.max, "us")}`]);
    rows.push(["compute", `p50 ${digits(status.compute_us.p50)}, p99.9 ${digits(status.compute_us.p99_9, "us")}`]);
    rows.push(["overruns", `${status.overruns}, slips ${status.slips}`]);
  }
  rows.push(["drawn", mode === null ? `displacements times ${digits(factor)}`
    : `mode ${mode + 1} alone, slowed down, not to scale`]);
  return rows;
}

/** Returns a text with the estimated error and the displacement it is compared with. */
function errorText({ judged_tick: tick, deformation_error: error, error_scale: scale }) {
  if (tick < 0) return "not judged";
  const share = scale > 0 ? `, ${digits((100 * error) / scale)} %` : "";
  return `displacements are off by about ${digits(error, "m")}${share} of ${digits(scale, "m")} (the tolerance or the peak displacement)`;
}

export function showRows(table, rows) {
  table.replaceChildren(...rows.map(([name, text, kind]) =>
    element("tr", {}, element("th", { textContent: name }), element("td", { textContent: text, className: kind ?? "" }))));
}

/** Returns the buttons of the modes. A button calls `onPick(mode)`, or `onPick(null)` to show no single mode. */
export function modeList(body, onPick) {
  const buttons = [];
  const pick = (mode) => {
    buttons.forEach((button, k) => button.classList.toggle("on", k === mode));
    onPick(mode);
  };
  body.frequencies.forEach((_, k) => {
    const button = element("button", { textContent: modeName(body, k) });
    button.onclick = () => pick(button.classList.contains("on") ? null : k);
    buttons.push(button);
  });
  return buttons;
}

/** Highlights the modes that move ([mode, peak energy [J]] each) and lists them with their fractions of the energy. */
export function markMoving(list, body, moving, buttons) {
  const sum = moving.reduce((all, [, energy]) => all + energy, 0);
  buttons.forEach((button, k) => button.classList.toggle("moving", moving.some(([mode]) => mode === k)));
  list.replaceChildren(...(moving.length === 0 ? ["no mode moves"] : moving.map(([mode, energy]) => {
    const button = element("button", { textContent: `${modeName(body, mode)}   ${digits((100 * energy) / sum)} %` });
    button.onclick = () => buttons[mode].click();
    return button;
  })));
}

/** Returns the colour legend: the axes, and for each unit a bar of link loads up to the largest load so far. */
export function colourLegend(body, scales) {
  const items = [element("span", {}, "axes ", ...["x", "y", "z"].map((name) => element("b", { className: `axis-${name}`, textContent: ` ${name}` })))];
  for (const [unit, scale] of scales) {
    if (scale > NO_LOAD * body.mass)
      items.push(element("span", { className: "bar" }, `compression ${digits(-scale)}`, element("i"), `${digits(scale)} tension [${unit}]`));
  }
  return items;
}

/** Returns the options of the list in which signals are chosen. */
export function signalOptions(body) {
  /** @type {[string, string[], string[]][]} */
  const groups = [["whole", ["rms:0", "attitude:0", "attitude:1", "attitude:2", "pointing:0", "rate:0", "rate:1", "rate:2", "spin:0",
    "energy:0", "error:0", "scale:0", "verdict:0", "late:0", "over:0"],
    ["rms displacement", "attitude x", "attitude y", "attitude z", "pointing error", "angular velocity x", "angular velocity y",
      "angular velocity z", "angular velocity, magnitude", "elastic energy", "error of deformation", "scale of this error", "verdict",
      "lateness p99.9", "overruns"]]];
  const list = (label, kind, count, name) => {
    const shown = Math.min(count, 1000);
    if (shown > 0) groups.push([label, Array.from({ length: shown }, (_, k) => `${kind}:${k}`), Array.from({ length: shown }, (_, k) => name(k))]);
  };
  list("modes", "mode", body.modes, (k) => modeName(body, k));
  list("wheels", "wheel", body.wheels.length, (k) => body.wheels[k]);
  list("points", "point", body.points, (k) => nameOf(body.pointNames, k));
  list("links", "load", body.publishedLinks.length, (k) => nameOf(body.linkNames, body.publishedLinks[k]));
  return groups.map(([label, keys, texts]) =>
    element("optgroup", { label }, ...keys.map((value, k) => element("option", { value, textContent: texts[k] }))));
}
