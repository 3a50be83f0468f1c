// The page: connects body, frames, picture, strips and controls.
import { parseBlob, fromBase64 } from "./blob.js";
import { Amplifier, modeFrame, rms, rotation, apply, worldPoint } from "./motion.js";
import { Camera, project } from "./camera.js";
import { Picture } from "./picture.js";
import { Strips, firstSignals } from "./strips.js";
import { Live, Player } from "./source.js";
import { Push, pick, forceOf, firstForce } from "./push.js";
import { colourLegend, digits, element, markMoving, modeList, recordedVerdict, showRows, signalOptions, statusRows } from "./panel.js";

/** @type {any} contains the data of a page without a server, and the page itself for tests */
const shared = window;
/** @returns {any} */
const $ = (id) => document.getElementById(id);
const MODE_TURNS = 0.5; // [Hz] frequency at which every mode is shown
const LONGEST_TRAIL = 2000;
const SILENCE = 1.5; // [s] time without a message after which the daemon is reported as silent
const MOST_FITTED = 2000; // points used to fit the camera
const MANY_LINES = 20000; // above this number of lines, the undeformed shape is off at first

// an answer disappears after this time; an error stays until its cause is gone
const SHOWN = 6000; // [ms]
let fading = 0;
function notice(text, isBad = true) {
  clearTimeout(fading);
  if (!isBad || text.startsWith("refused")) fading = setTimeout(() => notice(""), SHOWN);
  $("notice").textContent = text;
  $("notice").className = text ? (isBad ? "bad" : "fine") : "";
}

async function load() {
  const given = shared.freeflexData;
  if (given) return { body: parseBlob(fromBase64(given.body)), motion: given.motion ? parseBlob(fromBase64(given.motion)) : null };
  const token = new URLSearchParams(location.search).get("token") ?? "";
  const get = async (path) => {
    const answer = await fetch(`${path}?token=${token}`);
    if (!answer.ok) throw new Error(`${path}: ${answer.status} ${await answer.text()}`);
    return answer.status === 204 ? null : parseBlob(await answer.arrayBuffer());
  };
  return { body: await get("body"), motion: await get("motion"), token };
}

class Page {
  /** @param {{body: any, motion: any, token?: string}} loaded */
  constructor({ body, motion, token }) {
    this.body = body;
    this.picture = new Picture($("picture"), body);
    this.camera = new Camera(body.size || 1);
    this.amplifier = new Amplifier(body.size || 1);
    this.strips = new Strips($("strips"), body, (time) => this.seek(time));
    this.status = null;
    this.loads = null;
    this.mode = null; // the animated mode
    this.trail = [];
    this.trailTime = 0; // [s]
    this.heard = performance.now() / 1000;
    this.last = null; // [s]
    this.frame = this.world = null; // as they were last drawn
    this.target = [0, 0, 0];
    this.factor = 1;
    this.drawn = { frames: 0, since: performance.now(), rate: 0 };
    this.push = new Push(body, (message) => this.live?.send(message), notice);
    if (motion) {
      this.player = new Player(motion, body.modes);
    } else if (token !== undefined) {
      const url = `${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/ws?token=${token}`;
      this.live = new Live(url, {
        state: (frame) => {
          this.heard = performance.now() / 1000;
          this.sample(frame);
        },
        loads: (values) => { this.loads = values; this.picture.setLoads(values); },
        text: (message) => this.hear(message),
        closed: () => notice("freeflex view does not answer, because it has ended or is busy"),
      });
    }
    const step = Math.max(1, Math.ceil(body.points / MOST_FITTED)), R = rotation(body.attitude);
    this.outline = Array.from({ length: Math.ceil(body.points / step) }, (_, k) => apply(R, [...body.rest.slice(3 * step * k, 3 * step * k + 3)]));
    this.camera.face(this.outline);
    this.isFitted = true; // until the user zooms or moves
    this.layOut();
    this.listen();
    requestAnimationFrame((now) => this.tick(now / 1000));
  }

  hear(message) {
    if (message.status) {
      this.status = message.status;
      // a status may have waited in the program, so its own time is used; page and program read the clock of the same
      // machine
      this.heard = performance.now() / 1000 - Math.max(0, (1000 * Date.now() - message.status.utime) / 1e6);
    }
    if (message.modes) this.setMoving(message.modes);
    if (message.ack) this.push.answered(message.ack);
    if (message.notice !== undefined) {
      this.trouble = message.notice;
      if (message.notice) this.status = null; // the last status belongs to another plan
    }
  }

  layOut() {
    const { body } = this;
    document.title = `${body.name} - freeflex`;
    this.buttons = modeList(body, (mode) => { this.mode = mode; });
    $("modes").replaceChildren(...this.buttons);
    if (body.modes < body.allModes)
      $("modes").prepend(element("p", { textContent: `the lowest ${body.modes} of ${body.allModes} modes are drawn` }));
    if (body.unknownPoints > 0)
      $("modes").prepend(element("p", { textContent: `${body.unknownPoints} points are drawn at their rest positions, because the plan file has no mode shapes for them; open the scene instead` }));
    $("signals").append(...signalOptions(body));
    const hasStatus = !this.player || this.player.recording.motion.statuses?.length > 0;
    for (const key of firstSignals(body, hasStatus)) this.strips.toggle(key);
    this.setMoving(this.player?.recording.motion.modes ?? []);
    $("signals").onchange = () => {
      const target = $("signals");
      if (target.value) this.strips.toggle(target.value);
      target.value = "";
      if (this.player) this.strips.fill(this.player.recording);
    };
    $("ghost").checked = body.lineLinks.length <= MANY_LINES;
    $("newtons").value = firstForce(body);
    $("player").hidden = !this.player;
    $("pushing").hidden = !this.live || body.pushable.length === 0;
    if (this.player) {
      const { begin, end } = this.player.recording;
      Object.assign($("bar"), { min: begin, max: end, step: (end - begin) / 2000 || 1, value: begin });
      this.strips.fill(this.player.recording);
    }
    for (const group of body.groups) {
      const label = element("span", { className: "label", textContent: group.name });
      $("labels").append(label);
      group.label = label;
      group.isMassless = group.points.every((point) => body.masses[point] === 0);
    }
  }

  /** Sets the modes that move, as a list of [mode, peak energy [J]]. */
  setMoving(moving) {
    const text = JSON.stringify(moving);
    if (text === this.moving) return;
    this.moving = text;
    markMoving($("moving"), this.body, moving, this.buttons);
    if (this.strips.follow(moving.map(([mode]) => mode)) && this.player) this.strips.fill(this.player.recording);
  }

  listen() {
    const canvas = $("picture");
    let from = null;
    canvas.onpointerdown = (event) => {
      canvas.setPointerCapture(event.pointerId);
      from = { x: event.clientX, y: event.clientY, start: [event.clientX, event.clientY] };
      const point = event.button === 0 && !event.shiftKey && this.live ? this.pointAt(event) : null;
      if (point !== null) this.push.begin(point);
    };
    canvas.onpointermove = (event) => {
      if (!from) return;
      const dx = event.clientX - from.x, dy = event.clientY - from.y;
      if (this.push.point !== null) {
        const [x, y] = from.start;
        this.push.drag(forceOf(this.camera, event.clientX - x, event.clientY - y, Number($("newtons").value) || 0),
          performance.now() / 1000);
      } else if (event.shiftKey || event.buttons === 2) {
        this.camera.move(dx, dy, canvas.clientHeight);
        this.isFitted = false;
      } else {
        this.camera.turn(dx, dy);
        if (this.isFitted) this.camera.fit(this.outline, canvas.clientWidth, canvas.clientHeight, true);
      }
      from.x = event.clientX;
      from.y = event.clientY;
    };
    canvas.onpointerup = canvas.onpointercancel = () => {
      from = null;
      this.push.end();
    };
    canvas.oncontextmenu = (event) => event.preventDefault();
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.camera.approach(Math.sign(event.deltaY));
      this.isFitted = false;
    }, { passive: false });
    $("play").onclick = () => {
      this.player.isPlaying = !this.player.isPlaying;
      $("play").textContent = this.player.isPlaying ? "pause" : "play";
    };
    $("bar").oninput = () => this.seek(Number($("bar").value));
    $("speed").onchange = () => { this.player.speed = Number($("speed").value); };
    $("amplify").onchange = () => { $("factor").disabled = $("amplify").checked; };
  }

  seek(time) {
    if (this.player) this.player.time = time;
  }

  pointAt({ offsetX, offsetY }) {
    const canvas = $("picture");
    return this.frame && this.world
      ? pick(this.body, this.frame, this.factor, this.target, this.world, canvas.clientWidth, canvas.clientHeight, offsetX, offsetY)
      : null;
  }

  /** Returns the frame to draw now. */
  frameNow(now, dt) {
    if (this.mode !== null) return modeFrame(this.body, this.mode, now * MODE_TURNS);
    if (this.player) {
      this.player.advance(dt);
      this.status = this.player.recording.status(this.player.time);
      this.picture.setLoads(this.player.recording.loads(this.player.time));
      return this.player.frame();
    }
    return this.live?.frame ?? modeFrame(this.body, -1, 0);
  }

  factorNow(frame, dt) {
    if (this.mode !== null) return 1;
    if ($("amplify").checked) return this.amplifier.take(rms(frame.q), dt);
    return $("factor").value === "" ? 1 : Number($("factor").value);
  }

  tick(now) {
    requestAnimationFrame((next) => this.tick(next / 1000));
    const dt = this.last === null ? 0 : now - this.last;
    this.last = now;
    this.resize();
    const frame = this.frameNow(now, dt), factor = this.factorNow(frame, dt);
    const target = $("follow").checked ? frame.position : [0, 0, 0];
    this.take(frame);
    this.world = this.picture.draw(frame, {
      camera: this.camera, factor, target, ghost: $("ghost").checked, extras: this.extras(frame, factor, target),
      trail: this.trail.flatMap((position) => [...position.map((x, axis) => x - target[axis]), 0.45, 0.75, 0.5]),
    });
    Object.assign(this, { frame, factor, target });
    this.push.tick(now);
    this.label(frame, factor, target);
    this.updatePanel(now, frame, factor);
    ++this.drawn.frames;
  }

  resize() {
    const canvas = $("picture"), scale = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * scale), height = Math.round(canvas.clientHeight * scale);
    if (canvas.width === width && canvas.height === height) return;
    Object.assign(canvas, { width, height });
    if (this.isFitted) this.camera.fit(this.outline, width, height);
  }

  /** Adds the centre of mass to the trail. */
  take(frame) {
    if (this.mode !== null) return;
    if (frame.time < this.trailTime || frame.time > this.trailTime + 1) this.trail = []; // after a reset or a seek
    this.trailTime = frame.time;
    const last = this.trail.at(-1);
    const step = last ? Math.hypot(...frame.position.map((x, axis) => x - last[axis])) : Infinity;
    if (step > 0.01 * this.body.size) this.trail.push([...frame.position]);
    if (this.trail.length > LONGEST_TRAIL) this.trail.shift();
  }

  /** Adds a received state to the strips, which show all states, not only the states that are drawn. */
  sample(frame) {
    this.strips.take(frame.time, frame, this.status, this.loads);
  }

  /** Returns lines for the axes of the body and the groups, and for the force that the mouse applies. */
  extras(frame, factor, target) {
    const lines = [], R = rotation(frame.attitude);
    const line = (a, b, colour) => lines.push(...a, ...colour, ...b, ...colour);
    const cross = (at, size, dim) => {
      for (let axis = 0; axis < 3; ++axis) {
        const colour = [0, 1, 2].map((k) => (k === axis ? 1 : 0.25) * dim);
        const end = apply(R, [0, 1, 2].map((k) => (k === axis ? size : 0)));
        line(at, at.map((x, k) => x + end[k]), colour);
      }
    };
    if ($("axes").checked) {
      cross(frame.position.map((x, k) => x - target[k]), 0.25 * this.body.size, 1);
      for (const group of this.body.groups) cross(this.groupPosition(group, frame, factor, target), 0.1 * this.body.size, 0.7);
    }
    if (this.push.point !== null) {
      const from = worldPoint(this.body, frame, this.push.point, factor).map((x, k) => x - target[k]);
      const scale = (100 * this.camera.metresPerPixel($("picture").clientHeight)) / (Number($("newtons").value) || 1);
      line(from, from.map((x, k) => x + scale * this.push.force[k]), [1, 0.9, 0.2]);
    }
    return lines;
  }

  /** Returns the mean position of some points of a group, weighted by mass unless all of them are massless. */
  groupPosition(group, frame, factor, target) {
    const step = Math.max(1, Math.floor(group.points.length / 50));
    const sum = [0, 0, 0, 0];
    for (let k = 0; k < group.points.length; k += step) {
      const point = group.points[k], mass = group.isMassless ? 1 : this.body.masses[point];
      worldPoint(this.body, frame, point, factor).forEach((x, axis) => { sum[axis] += mass * (x - target[axis]); });
      sum[3] += mass;
    }
    return sum.slice(0, 3).map((x) => x / (sum[3] || 1));
  }

  label(frame, factor, target) {
    const canvas = $("picture");
    for (const group of this.body.groups) {
      const [x, y, depth] = project(this.world, this.groupPosition(group, frame, factor, target), canvas.clientWidth, canvas.clientHeight);
      group.label.hidden = !$("axes").checked || depth < 0;
      group.label.style.transform = `translate(${x}px, ${y}px)`;
    }
  }

  /** Updates the panel next to the picture, a few times a second. */
  updatePanel(now, frame, factor) {
    if (now - (this.panelTime ?? -1) < 0.2) return;
    this.panelTime = now;
    const { drawn } = this, passed = performance.now() - drawn.since;
    if (passed > 1000) Object.assign(drawn, { rate: (1000 * drawn.frames) / passed, frames: 0, since: performance.now() });
    showRows($("status"), [...statusRows(this.body, this.mode === null ? frame : null, this.status, factor, this.mode, !!this.player),
      ...(this.player ? [recordedVerdict(this.player.recording.verdict())] : []), ["picture", `${drawn.rate.toFixed(1)} frames a second`], ...this.sampling()]);
    $("status").classList.toggle("stale", !!this.live && performance.now() / 1000 - this.heard > SILENCE);
    const scales = [...this.picture.loadScales], scalesText = JSON.stringify(scales);
    if (scalesText !== this.legendScales) $("legend").replaceChildren(...colourLegend(this.body, scales));
    this.legendScales = scalesText;
    if (this.player) {
      $("bar").value = this.player.time;
      $("clock").textContent = digits(this.player.time, "s");
      this.strips.setNow(this.player.time);
    }
    if (!this.live) return;
    this.strips.draw();
    this.showTrouble();
  }

  /** Returns the row of the panel with the sampling rate and the frequency above which motion is aliased. */
  sampling() {
    const motion = this.player?.recording.motion;
    const rate = motion ? (motion.time.length - 1) / (motion.clock.at(-1) - motion.clock[0]) : this.strips.rate();
    if (!Number.isFinite(rate) || rate <= 0) return [];
    const some = motion && motion.allStates > motion.shownStates ? `, ${motion.shownStates} of ${motion.allStates}` : "";
    return [["states", `${digits(rate)} a second${some}; motion above ${digits(0.5 * rate, "Hz")} is aliased`]];
  }

  showTrouble() {
    const silence = performance.now() / 1000 - this.heard;
    if (!this.live.isOpen) return;
    if (this.trouble) notice(this.trouble);
    else if (this.status?.mode === "fault") notice(`fault: ${this.status.fault}`);
    else if (this.status?.mode === "stopped") notice("the daemon has stopped");
    else if (silence > SILENCE) notice(this.status ? `nothing heard from the daemon for ${silence.toFixed(0)} s` : "no message of a daemon has come yet");
    else if ($("notice").className === "bad" && !$("notice").textContent.startsWith("refused")) notice("");
  }
}

load().then((loaded) => { shared.freeflexPage = new Page(loaded); }, (error) => notice(String(error)));
window.addEventListener("error", ({ message }) => notice(message));
window.addEventListener("unhandledrejection", ({ reason }) => notice(String(reason)));
