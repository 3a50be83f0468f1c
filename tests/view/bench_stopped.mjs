// Compares the lateness of the daemon's ticks alternately with and without a browser that has stopped reading. Run it in
// a private network; FREEFLEX_BIN is the folder of the programs, FREEFLEX_SOURCE the source tree.
import { spawn, spawnSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { Browser, chromium } from "./browser.mjs";

const ROUNDS = 4, SECONDS = 15;
const bin = process.env.FREEFLEX_BIN, scene = join(process.env.FREEFLEX_SOURCE, "service", "scenes", "satellite.yaml");
if (!chromium) {
  console.log("there is no chromium");
  process.exit(0);
}
const folder = mkdtempSync(join(tmpdir(), "freeflex-stopped-"));
const start = (program, ...options) => spawn(join(bin, program), options, { stdio: ["ignore", "pipe", "ignore"] });
const sleep = (seconds) => new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
const median = (all) => all.sort((a, b) => a - b)[Math.floor(all.length / 2)];

/** Returns the p99.9 of lateness [us] of each window over SECONDS. */
function lateness() {
  const { stdout } = spawnSync(join(bin, "freeflex"), ["monitor", "--channel", "STATUS", "--json", "--duration", String(SECONDS)]);
  return String(stdout).trim().split("\n").map((line) => JSON.parse(line).message.lateness_us.p99_9).filter((x) => x > 0);
}
const memory = (pid) => Number(/VmRSS:\s+(\d+)/.exec(readFileSync(`/proc/${pid}/status`, "utf8"))[1]) / 1024;

const daemon = start("freeflexd", scene, "--log-level", "off", "--socket", "none");
const view = start("freeflex", "view", scene);
const url = await new Promise((resolve) => {
  view.stdout.setEncoding("utf8").on("data", (text) => resolve(/http:\/\/\S+/.exec(text)[0]));
});
const without = [], stopped = [];
const before = memory(view.pid);
for (let round = 0; round < ROUNDS; ++round) {
  without.push(...lateness());
  const browser = new Browser(join(folder, String(round)), true);
  await browser.open(url);
  await browser.until("window.freeflexPage?.live?.frame", 30);
  process.kill(-browser.process.pid, "SIGSTOP");
  await sleep(1);
  stopped.push(...lateness());
  process.kill(-browser.process.pid, "SIGKILL");
  await sleep(1);
}
console.log(`lateness p99.9, median of windows  ${median(without).toFixed(0)} us without, ${median(stopped).toFixed(0)} us with a browser that is stopped, ` +
  `ratio ${(median(stopped) / median(without)).toFixed(2)}`);
console.log(`memory of freeflex view            ${before.toFixed(1)} MB before, ${memory(view.pid).toFixed(1)} MB after ${ROUNDS} such browsers`);
daemon.kill("SIGINT");
view.kill("SIGINT");
rmSync(folder, { recursive: true, force: true, maxRetries: 5 });
process.exit(0);
