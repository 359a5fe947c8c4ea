// Drives the console of a simulated station in a real Chromium: set-up, a scan from start to result,
// every page in two languages and three sizes. Writes screenshots, counts axe's findings (WCAG 2.2
// AA) and requests to elsewhere, and prints a table. Usage (docs/console.md):
//   node tests/console/drive.mjs ADDRESS SET-UP-CODE FOLDER
import { mkdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(new URL("../../daemon/web/package.json", import.meta.url));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const [address, code, folder] = process.argv.slice(2);
mkdirSync(folder, { recursive: true });

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const context = await browser.newContext({ ignoreHTTPSErrors: true, locale: "en-GB", bypassCSP: false });
const page = await context.newPage();
page.setDefaultTimeout(60000);
let elsewhere = 0;
const complaints = [];
page.on("request", (request) => {
  if (!request.url().startsWith(address) && !/^(blob|data):/.test(request.url())) ++elsewhere;
});
page.on("console", (message) => {
  if (message.type() === "error") complaints.push(message.text());
});
page.on("pageerror", (error) => complaints.push(String(error)));

const sizes = { kiosk: [1024, 768], desk: [1440, 900], phone: [390, 844] };
const found = [];
// axe is run outside the page's content security policy, by the debugger.
async function look(name) {
  for (const [size, [width, height]] of Object.entries(sizes)) {
    await page.setViewportSize({ width, height });
    await page.waitForTimeout(400);
    await page.screenshot({ path: join(folder, `${name}_${size}.png`), fullPage: size !== "kiosk" });
    const wider = await page.evaluate(() => document.documentElement.scrollWidth > window.innerWidth);
    if (wider) complaints.push(`${name} ${size}: wider than the screen`);
  }
  await page.setViewportSize({ width: 1024, height: 768 });
  await page.evaluate(axe);
  const result = await page.evaluate(() =>
    // eslint-disable-next-line no-undef
    axe.run({ runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"] }),
  );
  for (const v of result.violations) found.push(`${name}: ${v.id} ${v.nodes.map((n) => n.target).join(" ")}`);
}
async function inBoth(name, ready) {
  for (const language of ["en", "de"]) {
    await page.evaluate((l) => localStorage.setItem("language", l), language);
    await page.reload();
    await ready();
    await look(`${name}_${language}`);
  }
  await page.evaluate(() => localStorage.setItem("language", "en"));
  await page.reload();
}
const go = (path) => page.goto(`${address}/#/${path}`);
const heading = () => page.waitForSelector("h1");

await page.goto(address);
await inBoth("setup", heading);
await heading();
const inputs = page.locator("input");
await inputs.nth(0).fill(code);
await inputs.nth(1).fill("anna");
await inputs.nth(2).fill("correct horse battery");
await page.keyboard.press("Enter");
await page.waitForSelector("nav");

// An examiner works on; the administrator makes his account.
await go("accounts");
await page.waitForSelector("tbody tr");
await page.locator("input[pattern]").fill("examiner");
await page.locator("form select").first().selectOption("examiner");
await page.locator("input[minlength]").first().fill("correct horse battery");
await page.locator("form button.main").click();
await page.waitForSelector("tbody tr:nth-child(2)");
await inBoth("accounts", () => page.waitForSelector("tbody tr"));
await go("station");
await inBoth("station", () => page.waitForSelector("tbody tr"));
await go("audit");
await inBoth("audit", () => page.waitForSelector("tbody tr"));
await page.getByRole("button", { name: "Sign out" }).click();
await inBoth("sign_in", heading);
await heading();
await page.locator("input").nth(0).fill("examiner");
await page.locator("input").nth(1).fill("correct horse battery");
await page.keyboard.press("Enter");
await page.waitForSelector("button.big");

// Not by page.waitForFunction(): the content security policy forbids what it does.
const state = (words) => page.locator(".state h1", { hasText: words }).waitFor({ timeout: 300000 });
const sliders = () => page.locator("input[type=range]").nth(1).waitFor();
await go("table");
await inBoth("ready", () => page.waitForSelector(".state.good"));
await page.waitForSelector("button.big");
// Keyboard alone: the case number has the focus, Enter starts.
await page.keyboard.type("2026-<b>0042</b>");
await page.keyboard.press("Enter");
await state("Photographing");
await page.waitForSelector(".dome .taken");
await look("scanning_en");
await state("Your turn");
await inBoth("turn_over", () => page.waitForSelector("button.big"));
await page.getByRole("button", { name: "It lies as asked" }).click();
await state("Ready");
await page.waitForSelector("li .tag.building, li .tag.done");
await look("building_en");
await page.getByRole("link", { name: "2026-<b>0042</b>" }).click();
await page.waitForSelector("h1");
await look("case_building_en");
await page.waitForSelector("canvas", { timeout: 300000 });

const begun = Date.now();
await page.reload();
await sliders();
const shownMs = Date.now() - begun;
await inBoth("result", sliders);
await sliders();
const steps = [];
for (let i = 0; i < 10; ++i) {
  steps.push(
    await page.evaluate(
      (value) =>
        new Promise((resolve) => {
          const slider = document.querySelectorAll("input[type=range]")[1];
          const canvas = document.querySelector("canvas");
          const before = performance.now();
          canvas.addEventListener("drawn", () => resolve(performance.now() - before), { once: true });
          slider.value = String(value);
          slider.dispatchEvent(new Event("input"));
        }),
      0.3 * (i + 1),
    ),
  );
}
steps.sort((a, b) => a - b);
await look("result_changed_en");
await page.locator("select").nth(2).selectOption("over");
await page.locator("input[type=range]").first().fill("0.5");
await page.locator("select").nth(1).selectOption("uncertainty");
await page.waitForTimeout(1500);
await look("result_over_en");
await page.locator("select").nth(0).selectOption("skull");
await page.waitForTimeout(3000);
await look("result_scanned_en");
await page.getByText("Measure", { exact: true }).click();
await page.getByRole("button", { name: "Mark the middle" }).click();
await page.locator("canvas").focus();
for (let i = 0; i < 3; ++i) await page.keyboard.press("ArrowRight");
await page.waitForTimeout(500);
await page.getByRole("button", { name: "Mark the middle" }).click();
const measured = await page.getByText("Distance:").textContent();
await page.locator("textarea").fill("looked at");
await page.getByRole("button", { name: "Approve and sign off" }).click();
await page.waitForSelector(".note.good");
await go("cases");
await inBoth("cases", () => page.waitForSelector("tbody tr"));

console.log(`300k-triangle-class head on screen after ${shownMs} ms (reload to sliders)`);
console.log(`slider to drawn: median ${steps[5].toFixed(0)} ms, longest ${steps[9].toFixed(0)} ms`);
console.log(`measured with the keyboard: ${measured}`);
console.log(`requests to elsewhere: ${elsewhere}`);
console.log(`axe violations: ${found.length}`);
for (const line of [...found, ...complaints]) console.log(`  ${line}`);
await browser.close();
process.exit(found.length + elsewhere > 0 ? 1 : 0);
