/** A browser with the page, and what every test holds against it: no complaint, no failed request. */

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
/** Where pictures of the page are kept; nowhere if unset. */
const PICTURES = process.env.LOOKDOWN_PAGE_PICTURES;
export const WIDE = { width: 1440, height: 900 };
export const PHONE = { width: 390, height: 844 };

let browser;
after(() => browser?.close());

/**
 * A test of a fresh page at `path`. Whatever the browser complains of fails it, unless `expected` matches.
 * Options: `viewport`, `colorScheme`, `server`, `expected`.
 */
export function pageTest(name, path, act, options = {}) {
  test(name, { timeout: 120_000 }, async () => {
    browser ??= await chromium.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", args: ["--no-sandbox"] });
    const { viewport = WIDE, colorScheme = "light", server = SERVER, expected = /^$/ } = options;
    const context = await browser.newContext({ viewport, colorScheme, reducedMotion: "reduce", baseURL: `${server}/`, acceptDownloads: true });
    const page = await context.newPage();
    page.setDefaultTimeout(60_000);
    const complaints = [];
    // Of cameras whose pictures are not kept there is none.
    const note = (text) => expected.test(text) || /status of 404 .*latest\.jpg/.test(text) || complaints.push(text);
    page.on("console", (message) => ["error", "warning"].includes(message.type()) && note(`${message.text()} ${message.location().url}`));
    page.on("pageerror", (error) => note(error.stack));
    page.on("requestfailed", (request) => {
      // A newer question takes the place of one that is under way, and a stream ends with its section.
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

/** Shows a sample and waits for its persons; `lens` names a calibration. */
export async function detectSample(page, name, lens = "") {
  await page.locator(`#calibration option[value="${lens}"]`).waitFor({ state: "attached" });
  await page.selectOption("#calibration", lens);
  await page.getByRole("button", { name, exact: true }).click();
  await page.locator("#persons li").first().waitFor();
}

/** Sends a sample as a camera does. */
export async function post(camera, sample, parameters = "profile=fast") {
  const body = await readFile(`${SAMPLES}/${sample}.jpg`);
  const answer = await fetch(`${SERVER}/detect?${parameters}&calibration=${sample}&camera=${camera}`, { method: "POST", body });
  assert.equal(answer.status, 200);
  return answer.json();
}

/** The report that the page has after `act` and did not have before. */
export async function reportAfter(page, act) {
  await page.evaluate(async () => {
    window.shared = (await import("/assets/shared.js")).shared;
    window.before = window.shared.report;
  });
  await act();
  const report = await page.waitForFunction(() => window.shared.report !== window.before && window.shared.report);
  return report.jsonValue();
}

/** What axe-core finds wrong with what is shown now. */
export async function assertAccessible(page) {
  // The policy of the page lets no script in, but the debugger may evaluate one.
  await page.evaluate(`(() => { ${AXE} })(); void 0`);
  const { violations } = await page.evaluate("axe.run(document)");
  const told = violations.map(({ id, impact, nodes }) => `${id} (${impact}): ${nodes.map((node) => node.target.join(" ")).join(", ")}`);
  assert.deepEqual(told, []);
}

/** Nothing reaches beyond the right edge. */
export async function assertFits(page) {
  const beyond = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  assert.ok(beyond <= 0, `${beyond} pixels beyond the right edge`);
}

/** Keeps a picture of the whole page, if pictures are wanted. */
export async function picture(page, name) {
  if (!PICTURES) return;
  await page.mouse.move(0, 0);
  await page.screenshot({ path: `${PICTURES}/page-${name}.jpg`, type: "jpeg", quality: 80, fullPage: true });
}
