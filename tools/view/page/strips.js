// Draws values over time with dygraphs, in one strip per quantity.
import { displacement, rms, rotationBetween } from "./motion.js";
import { modeNumber, nameOf } from "./blob.js";
import { digits, element } from "./panel.js";

const KEPT = 60; // [s] length of a live motion that is kept
const MOST_SAMPLES = 20000;

const DEGREES = 180 / Math.PI;
const AXES = ["x", "y", "z"];
const MOST_WHEELS = 8;

/** Returns the signal of a key: {strip, label, read(frame, status, loads)}. Signals of one strip have the same unit. */
export function signalOf(body, key) {
  const [kind, index] = key.split(":"), k = Number(index);
  const of = (strip, label, read) => ({ strip, label, read });
  const ofStatus = (strip, label, read) => of(strip, label, (_, status) => (status ? read(status) : null));
  const turned = (frame) => rotationBetween(body.attitude, frame.attitude);
  switch (kind) {
    case "point":
      return of("elastic displacement [m]", nameOf(body.pointNames, k), (frame) => Math.hypot(...displacement(body, frame.q, k)));
    case "mode":
      return of("elastic coordinates [m] of the modes with the largest peak energy", modeName(body, k), (frame) => frame.q[k]);
    case "load":
      return of(`link loads [${body.loadUnits[k]}]`, nameOf(body.linkNames, body.publishedLinks[k]),
        (_frame, _status, loads) => (loads ? loads[k] : null));
    case "rms": return of("elastic displacement [m]", "rms over the mass", (frame) => rms(frame.q));
    case "attitude":
      return of("attitude [deg]: rotation vector from the initial attitude, its body axes", AXES[k],
        (frame) => DEGREES * turned(frame)[k]);
    case "pointing":
      return of("pointing error [deg]: angle from the initial attitude", "angle", (frame) => DEGREES * Math.hypot(...turned(frame)));
    case "rate": return of("angular velocity [rad/s], body axes", AXES[k], (frame) => frame.spin[k]);
    case "spin": return of("angular velocity [rad/s], body axes", "magnitude", (frame) => Math.hypot(...frame.spin));
    case "wheel": return of("angular momenta of wheels [N m s]", body.wheels[k], (frame) => frame.wheels[k] ?? null);
    case "energy": return ofStatus("elastic energy [J]", "energy", (s) => s.kinetic_elastic + s.potential);
    case "error": return ofStatus("error of deformation [m]", "estimate", (s) => s.deformation_error);
    case "scale": return ofStatus("error of deformation [m]", "compared with", (s) => s.error_scale);
    case "verdict": return ofStatus("verdict: 0 good, 1 watch, 2 outside", "verdict", (s) => s.validity);
    case "late": return ofStatus("lateness of ticks [us]", "p99.9", (s) => s.lateness_us.p99_9);
    case "over": return ofStatus("overruns [ticks]", "overruns", (s) => s.overruns);
    default: return null;
  }
}

/** Returns a mode's number and frequency. */
export function modeName(body, k) {
  return `mode ${modeNumber(body, k)}, ${body.frequencies[k] === 0 ? "mechanism" : digits(body.frequencies[k], "Hz")}`;
}

/** Returns the signals that are shown at first, except the modes that move. `hasStatus`: there are STATUS messages. */
export function firstSignals(body, hasStatus) {
  const axes = (kind) => [0, 1, 2].map((k) => `${kind}:${k}`);
  const wheels = body.wheels.slice(0, MOST_WHEELS).map((_, k) => `wheel:${k}`);
  return [...(body.modes > 0 ? ["rms:0"] : []), ...axes("attitude"), "pointing:0", ...axes("rate"), ...wheels,
    ...(hasStatus ? ["energy:0", "error:0", "scale:0", "verdict:0"] : [])];
}

// colours that can be distinguished on black
const COLOURS = ["#6db3f2", "#f2b35c", "#7dd68a", "#ff8a7a", "#c9a0f0", "#5cd6d0", "#f07fb8", "#d8d86a"];

/** Returns true if an element is visible in the window; only visible strips are redrawn. */
function isSeen(holder) {
  const { top, bottom } = holder.getBoundingClientRect();
  return bottom > 0 && top < window.innerHeight;
}

const ORDER = ["elastic displacement", "elastic coordinates", "attitude", "pointing", "angular velocity", "angular momenta"];
const rankOf = ({ strip }) => {
  const rank = ORDER.findIndex((name) => strip.startsWith(name));
  return rank < 0 ? ORDER.length : rank;
};

export class Strips {
  /** @param onTime called with the time at which a strip was clicked */
  constructor(element, body, onTime) {
    this.element = element;
    this.body = body;
    this.onTime = onTime;
    this.times = []; // [s] the same for all signals
    this.signals = new Map(); // key -> {signal, values: one per time, null before the signal was added}
    this.graphs = new Map(); // strip -> {graph, keys}
    this.moving = []; // keys of modes that are shown because they move
    this.now = null;
  }
  has(key) {
    return this.signals.has(key);
  }
  toggle(key) {
    if (!this.signals.delete(key)) this.add(key);
    this.layOut();
  }
  add(key) {
    const signal = signalOf(this.body, key);
    if (signal) this.signals.set(key, { signal, values: new Array(this.times.length).fill(null) });
  }
  /** Shows the modes that move, given by index, and hides those shown before. Returns true if the modes changed. */
  follow(modes) {
    const keys = modes.map((mode) => `mode:${mode}`);
    if (keys.length === this.moving.length && keys.every((key) => this.moving.includes(key))) return false;
    for (const key of this.moving) if (!keys.includes(key)) this.signals.delete(key);
    for (const key of keys) if (!this.has(key)) this.add(key);
    this.moving = keys;
    this.layOut();
    return true;
  }
  layOut() {
    for (const { graph } of this.graphs.values()) graph?.destroy();
    this.graphs.clear();
    this.element.replaceChildren();
    const inOrder = [...this.signals].sort(([, a], [, b]) => rankOf(a.signal) - rankOf(b.signal));
    for (const [key, { signal }] of inOrder) {
      if (!this.graphs.has(signal.strip)) {
        const title = element("div", { className: "title", textContent: signal.strip });
        const legend = element("div", { className: "legend" }), holder = element("div", { className: "strip" });
        this.element.append(title, legend, holder);
        this.graphs.set(signal.strip, { legend, holder, keys: [], graph: null });
      }
      this.graphs.get(signal.strip).keys.push(key);
    }
    this.draw();
  }
  clear() {
    this.times = [];
    for (const one of this.signals.values()) one.values = [];
  }
  /** Adds one sample of every signal at a time [s]. */
  take(time, frame, status, loads) {
    const last = this.times.at(-1);
    if (time === last) return;
    if (time < last) this.clear(); // after a reset
    this.times.push(time);
    for (const { signal, values } of this.signals.values()) values.push(signal.read(frame, status, loads));
    let old = 0;
    while (this.times.length - old > 2 && time - this.times[old] > KEPT) ++old;
    if (old < 0.1 * this.times.length) return;
    this.times.splice(0, old);
    for (const { values } of this.signals.values()) values.splice(0, old);
  }
  /** Returns the rate of the samples [1/s]. */
  rate() {
    return (this.times.length - 1) / (this.times.at(-1) - this.times[0]);
  }
  /** Fills the strips with a whole recording. */
  fill(recording) {
    const step = Math.max(1, Math.ceil(recording.count / MOST_SAMPLES));
    this.clear();
    for (let k = 0; k < recording.count; k += step) {
      const clock = recording.motion.clock[k];
      this.times.push(clock);
      for (const { signal, values } of this.signals.values())
        values.push(signal.read(recording.frame(k), recording.status(clock), recording.loads(clock)));
    }
    this.draw(true);
  }
  /** Draws the strips. `isWhole`: draws also the strips outside the window. */
  draw(isWhole = false) {
    for (const one of this.graphs.values()) {
      if (one.graph && !isWhole && !isSeen(one.holder)) continue;
      const all = one.keys.map((key) => this.signals.get(key));
      const labels = ["time [s]", ...all.map(({ signal }) => signal.label)];
      const rows = this.times.map((time, k) => [time, ...all.map(({ values }) => values[k] ?? null)]);
      if (rows.length === 0) continue;
      if (one.graph) {
        one.graph.updateOptions({ file: rows });
        continue;
      }
      one.graph = new (/** @type {any} */ (globalThis).Dygraph)(one.holder, rows, {
        labels, labelsDiv: one.legend, colors: COLOURS, legend: "always", height: 100, connectSeparatedPoints: true, strokeWidth: 1.3,
        axisLabelFontSize: 10, axisLineColor: "#556", gridLineColor: "#2a2e36", axisLabelWidth: 60,
        digitsAfterDecimal: 6, axes: { y: { pixelsPerLabel: 16, axisLabelFormatter: (value) => digits(value) } },
        underlayCallback: (context, area, graph) => this.mark(context, area, graph),
        clickCallback: (_, time) => this.onTime?.(time),
      });
    }
  }
  /** Marks the present time of a recording. */
  setNow(time) {
    this.now = time;
    for (const one of this.graphs.values()) if (isSeen(one.holder)) one.graph?.updateOptions({});
  }
  mark(context, area, graph) {
    if (this.now === null) return;
    const x = graph.toDomXCoord(this.now);
    context.fillStyle = "#f0c060";
    context.fillRect(x, area.y, 1, area.h);
  }
}
