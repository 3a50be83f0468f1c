// `freeflex view` in a browser. Node runs it in a private network; FREEFLEX_BIN is the folder of the programs and
// FREEFLEX_SOURCE is the source tree.
import assert from "node:assert/strict";
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, rmSync, statSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, test } from "node:test";
import { Browser, chromium } from "./browser.mjs";

const bin = process.env.FREEFLEX_BIN, scenes = join(process.env.FREEFLEX_SOURCE, "service", "scenes");
const folder = mkdtempSync(join(tmpdir(), "freeflex-view-"));
const skip = chromium ? false : "there is no chromium: apt-get install chromium";
const processes = [];
after(() => {
  for (const one of processes) one.kill("SIGKILL");
  setTimeout(() => rmSync(folder, { recursive: true, force: true, maxRetries: 5 }), 500);
});

function start(program, ...options) {
  const child = spawn(join(bin, program), options, { cwd: folder, stdio: ["ignore", "pipe", "inherit"] });
  processes.push(child);
  return child;
}
async function urlOf(child) {
  let text = "";
  for await (const part of child.stdout.setEncoding("utf8")) {
    text += part;
    const found = /http:\/\/\S+/.exec(text);
    if (found) return found[0];
  }
  throw new Error(`no address: ${text}`);
}
const browser = chromium ? new Browser(join(folder, "profile")) : null;
after(() => browser?.close());

// two points on the x axis vibrate at 1 Hz without rotation; their distance is 1 m +- 2 cm
const SWING = `points:
  - {name: a, mass: 2, at: [0, 0, 0]}
  - {name: b, mass: 2, at: [1, 0, 0]}
links:
  - {spring: [a, b], stiffness: 39.478417604357434}
initial:
  points: {a: {displacement: [-0.01, 0, 0]}, b: {displacement: [0.01, 0, 0]}}
publish: {loads: {rate: 50, of: all}}
`;

/** Holds an expression for the centres [pixels] of the points' dots on the canvas, found by their colour. */
const DOTS = `(() => {
  const page = freeflexPage, canvas = document.getElementById("picture"), gl = page.picture.gl;
  const { width, height } = canvas, pixels = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  const sums = [];
  for (let y = 0; y < height; ++y) for (let x = 0; x < width; ++x) {
    const k = 4 * (y * width + x);
    if (!(pixels[k] > 220 && pixels[k + 1] > 170 && pixels[k + 1] < 230 && pixels[k + 2] < 130)) continue;
    const near = sums.find((s) => Math.abs(s.x / s.n - x) < 8 && Math.abs(s.y / s.n - y) < 8);
    if (near) { near.x += x; near.y += y; ++near.n; } else sums.push({ x, y, n: 1 });
  }
  return sums.map(({ x, y, n }) => [x / n, y / n]).sort((a, b) => a[0] - b[0]);
})()`;

test("points are drawn, and a push by the mouse is applied", { skip, timeout: 120000 }, async () => {
  writeFileSync(join(folder, "swing.yaml"), SWING);
  const daemon = start("freeflexd", "swing.yaml", "--verdict", "on", "--log-level", "error", "--socket", "none");
  const url = await urlOf(start("freeflex", "view", "swing.yaml"));
  await browser.open(url);
  await browser.until("window.freeflexPage?.live?.frame && freeflexPage.status");
  const first = await browser.value("freeflexPage.frame.tick");
  await browser.until(`freeflexPage.frame.tick > ${first} + 500`);
  // the view is from -y, so that x points to the right; displacements are shown 20 times as large; everything else is hidden
  await browser.value(`(() => {
    Object.assign(freeflexPage.camera, { yaw: -Math.PI / 2, pitch: 0, distance: 3 });
    for (const id of ["amplify", "ghost", "axes"]) document.getElementById(id).checked = false;
    document.getElementById("factor").value = 20;
  })()`);
  await new Promise((resolve) => setTimeout(resolve, 300));
  // each sample has the state and the pixels of one frame
  const samples = [];
  for (let k = 0; k < 40; ++k) {
    const { dots, tick, height } = await browser.value(`new Promise((resolve) => requestAnimationFrame(() => resolve({
      dots: ${DOTS}, tick: freeflexPage.frame.tick, height: document.getElementById("picture").height })))`);
    if (dots.length === 2) samples.push({ tick, distance: dots[1][0] - dots[0][0], height });
    await new Promise((resolve) => setTimeout(resolve, 37));
  }
  assert.ok(samples.length > 20, `${samples.length} pictures with two dots`);
  // expected: the picture of a pinhole camera at 3 m with a vertical angle of 0.7 rad, for the closed form of the vibration
  const focal = samples[0].height / 2 / Math.tan(0.35);
  const expected = (tick) => (focal / 3) * (1 + 20 * 0.02 * Math.cos((2 * Math.PI * tick) / 1000));
  const amplitude = (focal / 3) * 20 * 0.02;
  const worst = Math.max(...samples.map(({ tick, distance }) => Math.abs(distance - expected(tick))));
  const range = Math.max(...samples.map((s) => s.distance)) - Math.min(...samples.map((s) => s.distance));
  console.log(`${samples.length} pictures, largest difference ${worst.toFixed(2)} of ${amplitude.toFixed(1)} pixels`);
  assert.ok(range > amplitude, "it vibrates");
  assert.ok(worst < 0.02 * amplitude + 1, `${worst} pixels off, amplitude ${amplitude}`);
  assert.ok(await browser.value(`freeflexPage.picture.loadScales.get("N") > 0.5`), "links are coloured by their loads");

  // the mouse drags from the right point 80 pixels up
  const box = await browser.value(`(() => { const { left, top } = document.getElementById("picture").getBoundingClientRect();
    const [x, y] = ${DOTS}[1]; const canvas = document.getElementById("picture");
    return { x: left + x, y: top + canvas.height - y }; })()`);
  await browser.value("document.getElementById('factor').value = 0; document.getElementById('newtons').value = 5");
  await new Promise((resolve) => setTimeout(resolve, 300));
  const unamplified = await browser.value(`(() => { const { left, top } = document.getElementById("picture").getBoundingClientRect();
    const [x, y] = ${DOTS}[1]; const canvas = document.getElementById("picture");
    return { x: left + x, y: top + canvas.height - y, before: freeflexPage.frame.position[2] }; })()`);
  assert.ok(Math.abs(unamplified.y - box.y) < 2);
  await browser.mouse("mousePressed", unamplified.x, unamplified.y);
  for (let k = 1; k <= 8; ++k) await browser.mouse("mouseMoved", unamplified.x, unamplified.y - 10 * k);
  await browser.until("/accepted at tick/.test(document.getElementById('notice').textContent)");
  await browser.until(`freeflexPage.frame.position[2] > ${unamplified.before} + 0.01`);
  await browser.mouse("mouseReleased", unamplified.x, unamplified.y - 80, 0);
  // the test waits until the force has ended
  await new Promise((resolve) => setTimeout(resolve, 1000));
  writeFileSync(join(folder, "live.png"), await browser.picture());

  const rows = await browser.value("document.getElementById('status').innerText");
  assert.match(await browser.value("document.getElementById('legend').innerText"), /compression -[0-9.e-]+\s*[0-9.e-]+ tension \[N\]/);
  assert.match(rows, /lateness\s+p50 [0-9.]+, p99.9 [0-9.]+, most [0-9.]+ us/);
  assert.match(rows, /verdict\s+(good|watch|outside)/);

  // the button of a mode animates the mode
  await browser.value("document.querySelector('#modes button').click()");
  const spread = await browser.value(`new Promise((resolve) => {
    const seen = [];
    const look = () => { seen.push(freeflexPage.frame.q[0]); seen.length < 60 ? requestAnimationFrame(look) : resolve(Math.max(...seen) - Math.min(...seen)); };
    look(); })`);
  assert.ok(spread > 0);
  await browser.value("document.querySelector('#modes button').click()");

  daemon.kill("SIGTERM");
  await browser.until("/stopped|nothing heard/.test(document.getElementById('notice').textContent)");
  assert.deepEqual(browser.complaints, []);
});

test("a fault is shown", { skip, timeout: 60000 }, async () => {
  // the state is not finite under this force
  writeFileSync(join(folder, "fault.yaml"), SWING + "loads: [{forces: {a: [1e300, 1e300, 0]}, pulse: {start: 2, duration: 1}}]\n");
  start("freeflexd", "fault.yaml", "--log-level", "off", "--socket", "none");
  await browser.open(await urlOf(start("freeflex", "view", "fault.yaml")));
  await browser.until("/^fault: /.test(document.getElementById('notice').textContent)");
});

test("a recording plays from the program and from a single file", { skip, timeout: 120000 }, async () => {
  const ran = spawnSync(join(bin, "freeflex"), ["run", join(scenes, "satellite.yaml"), "--until", "5", "--out", join(folder, "flight.log")]);
  assert.equal(ran.status, 0, String(ran.stderr));
  const played = async (url) => {
    await browser.open(url);
    await browser.until("window.freeflexPage?.player");
    const { begin, end, count } = await browser.value("(({ begin, end, count }) => ({ begin, end, count }))(freeflexPage.player.recording)");
    assert.ok(end - begin > 4.9 && count > 100);
    await browser.value("freeflexPage.player.time = freeflexPage.player.recording.begin");
    await browser.until(`freeflexPage.player.time > ${begin} + 0.5`);
    await browser.value("document.getElementById('play').click()");
    const paused = await browser.value("freeflexPage.player.time");
    await new Promise((resolve) => setTimeout(resolve, 300));
    assert.equal(await browser.value("freeflexPage.player.time"), paused);
    const titles = await browser.value("[...document.querySelectorAll('.title')].map((title) => title.textContent)");
    for (const part of ["elastic coordinates [m]", "attitude [deg]", "pointing error [deg]", "angular velocity [rad/s]", "wheels [N m s]"])
      assert.ok(titles.some((title) => title.includes(part)), `${part}: ${titles}`);
    assert.match(await browser.value("document.getElementById('status').innerText"), /worst verdict\s+good throughout/);
    // on a narrow screen the panel is below the picture, not next to it
    await browser.send("Emulation.setDeviceMetricsOverride", { width: 420, height: 800, deviceScaleFactor: 1, mobile: false });
    await browser.until("document.getElementById('picture').clientWidth >= 400");
    assert.ok(await browser.value("document.getElementById('stage').getBoundingClientRect().bottom <= document.querySelector('aside').getBoundingClientRect().top"));
    await browser.send("Emulation.clearDeviceMetricsOverride");
    return browser.value("JSON.stringify(freeflexPage.player.recording.at(3))");
  };
  const live = await played(await urlOf(start("freeflex", "view", join(folder, "flight.log"))));
  const wrote = spawnSync(join(bin, "freeflex"), ["view", join(folder, "flight.log"), "--html", join(folder, "flight.html")]);
  assert.equal(wrote.status, 0, String(wrote.stderr));
  assert.equal(await played(`file://${join(folder, "flight.html")}`), live);
  console.log(`one page of ${(statSync(join(folder, "flight.html")).size / 1e6).toFixed(2)} MB`);
  assert.deepEqual(browser.complaints, []);
});
