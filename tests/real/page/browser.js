/** A browser with the page, and the checks of every test: no console message, no failed request. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import test, { after } from "node:test";
import { chromium } from "playwright-core";

const require = createRequire(import.meta.url);
const AXE = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");

export const SERVER = process.env.LOOKDOWN_URL;
export const SAMPLES = process.env.LOOKDOWN_SAMPLES;
/** The folder of screenshots. None are taken if it is unset. */
const IMAGES = process.env.LOOKDOWN_PAGE_IMAGES;
/** The screenshots that the documentation shows. */
const SHOWN = ["cameras-wide", "counts-wide", "floor-alert-wide", "views-wide", "zones-wide"];
export const WIDE = { width: 1440, height: 900 };
export const PHONE = { width: 390, height: 844 };

let browser;
after(() => browser?.close());

/**
 * A test of a fresh page at `path`. Any error or warning of the browser fails it, unless `expected` matches.
 * Options: `viewport`, `hasTouch`, `colorScheme`, `server`, `expected`.
 */
export function pageTest(name, path, act, options = {}) {
  test(name, { timeout: 240_000 }, async () => {
    browser ??= await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] });
    const { viewport = WIDE, hasTouch = false, colorScheme = "light", server = SERVER, expected = /^$/ } = options;
    const context = await browser.newContext({ viewport, hasTouch, colorScheme, reducedMotion: "reduce", baseURL: `${server}/`, acceptDownloads: true });
    const page = await context.newPage();
    page.setDefaultTimeout(60_000);
    const complaints = [];
    // Cameras without kept images give 404.
    const note = (text) => expected.test(text) || /status of 404 .*latest\.jpg/.test(text) || complaints.push(text);
    page.on("console", (message) => ["error", "warning"].includes(message.type()) && note(`${message.text()} ${message.location().url}`));
    page.on("pageerror", (error) => note(error.stack));
    page.on("requestfailed", (request) => {
      // A newer request replaces one in flight, and a stream ends with its section.
      const why = request.failure().errorText;
      if (why !== "net::ERR_ABORTED") note(`${request.url()}: ${why}`);
    });
    page.on("request", (request) => {
      const url = request.url();
      const isOwn = url.startsWith(server) || url.startsWith("blob:") || url.startsWith("data:");
      if (!isOwn) note(`asks elsewhere: ${url}`);
    });
    try {
      await page.goto(path);
      await act(page, context);
      assert.deepEqual(complaints, []);
    } finally {
      await context.close();
    }
  });
}

/** Opens a sample and waits for its persons. `lens` names its calibration; without one, it is an image of the user. */
export async function detectSample(page, name, lens = "") {
  await page.locator(`#calibration option[value="${lens}"]`).waitFor({ state: "attached" });
  await page.selectOption("#calibration", lens);
  if (lens) await page.getByRole("button", { name, exact: true }).click();
  else await page.locator("#frame-file").setInputFiles(`${SAMPLES}/${name}.jpg`);
  await page.locator("#persons li").first().waitFor();
}

/** Sends a sample like a camera. */
export async function post(camera, sample, parameters = "profile=fast") {
  const body = await readFile(`${SAMPLES}/${sample}.jpg`);
  const answer = await fetch(`${SERVER}/detect?${parameters}&calibration=${sample}&camera=${camera}`, { method: "POST", body });
  assert.equal(answer.status, 200);
  return answer.json();
}

/** The new report of the page after `act`. */
export async function reportAfter(page, act) {
  await page.evaluate(async () => {
    window.shared = (await import("/assets/shared.js")).shared;
    window.before = window.shared.report;
  });
  await act();
  const report = await page.waitForFunction(() => window.shared.report !== window.before && window.shared.report);
  return report.jsonValue();
}

/** The violations that axe-core finds in the current state. */
export async function assertAccessible(page) {
  // The policy of the page forbids scripts, but the debugger may evaluate one.
  await page.evaluate(`(() => { ${AXE} })(); void 0`);
  const { violations } = await page.evaluate("axe.run(document)");
  const told = violations.map(({ id, impact, nodes }) => `${id} (${impact}): ${nodes.map((node) => node.target.join(" ")).join(", ")}`);
  assert.deepEqual(told, []);
}

/** Asserts that the page has no horizontal overflow. */
export async function assertFits(page) {
  const beyond = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert.ok(beyond <= 0, `${beyond} pixels beyond the right edge`);
}

/** Takes a screenshot of the whole page, if screenshots are enabled and the documentation shows it. */
export async function screenshot(page, name) {
  if (!IMAGES || !SHOWN.includes(name)) return;
  await page.mouse.move(0, 0);
  await page.screenshot({ path: `${IMAGES}/page-${name}.jpg`, type: "jpeg", quality: 80, fullPage: true });
}
