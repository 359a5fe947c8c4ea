// Drives the console of a simulated station in a real Chromium, by keyboard alone: set-up, two
// scans, the second while the first is being built, with an emergency stop in between; results,
// report, approval, every page; in two languages and three sizes. Writes screenshots, counts axe's
// findings (WCAG 2.2 AA), pages wider than the screen, errors in pages and requests to elsewhere.
// Usage (docs/console.md):  node tests/console/drive.mjs ADDRESS SET-UP-CODE FOLDER
import { mkdirSync, readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join } from "node:path";

const require = createRequire(new URL("../../daemon/web/package.json", import.meta.url));
const { chromium } = require("playwright-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const [address, code, folder] = process.argv.slice(2);
const password = "correct horse battery";
mkdirSync(folder, { recursive: true });

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const context = await browser.newContext({ ignoreHTTPSErrors: true, locale: "en-GB" });
context.setDefaultTimeout(120000);
let elsewhere = 0;
let views = 0;
const found = [];
const complaints = [];
context.on("request", (request) => {
  if (!request.url().startsWith(address) && !/^(blob|data):/.test(request.url())) ++elsewhere;
});
context.on("weberror", (error) => complaints.push(String(error.error())));
context.on("console", (message) => {
  // Looked for and not there: a preview while the cameras work, a session before the sign-in, a scan that has just ended.
  const usual = /status of (401|403|500|503)/.test(message.text()) || message.location().url.endsWith("/station/scan");
  if (message.type() === "error" && !usual) complaints.push(`${message.text()} ${message.location().url}`);
});
const page = await context.newPage();

const sizes = { kiosk: [1024, 768], desk: [1440, 900], phone: [390, 844] };
/** Pictures in all sizes, and axe, which the debugger runs outside the page's security policy. */
async function look(name, at = page) {
  for (const [size, [width, height]] of Object.entries(sizes)) {
    await at.setViewportSize({ width, height });
    await at.waitForTimeout(500);
    await at.screenshot({ path: join(folder, `${name}_${size}.png`), fullPage: size !== "kiosk" });
    const wider = await at.evaluate(() => document.documentElement.scrollWidth > window.innerWidth);
    if (wider) complaints.push(`${name} ${size}: wider than the screen`);
  }
  await at.setViewportSize({ width: 1024, height: 768 });
  await at.evaluate(axe);
  const result = await at.evaluate(() =>
    // eslint-disable-next-line no-undef
    axe.run({ runOnly: ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"] }),
  );
  ++views;
  for (const v of result.violations) found.push(`${name}: ${v.id} ${v.nodes.map((n) => n.target).join(" ")}`);
}
async function inBoth(name, ready) {
  for (const language of ["de", "en"]) {
    await page.evaluate((l) => localStorage.setItem("language", l), language);
    await page.reload();
    await ready();
    await look(`${name}_${language}`);
  }
}
/** With the tab key until the element has the focus; what can't be reached so is a finding. */
async function reach(locator) {
  await locator.waitFor();
  for (let i = 0; i < 150; ++i) {
    if (await locator.evaluate((element) => element === document.activeElement)) return;
    await page.keyboard.press("Tab");
  }
  throw new Error(`the keyboard does not reach ${locator}`);
}
const press = async (locator, key = "Enter") => (await reach(locator), await page.keyboard.press(key));
const type = async (locator, text) => (await reach(locator), await page.keyboard.type(text));
const button = (name) => page.getByRole("button", { name, exact: true });
const link = (name) => page.getByRole("link", { name, exact: true });
const choose = async (label, option) => {
  await reach(page.getByRole("combobox", { name: label, exact: true }));
  await page.keyboard.type(option);
};
const state = (words) => page.locator(".state h1", { hasText: words }).waitFor();
const slider = (n) => page.locator("input[type=range]").nth(n);
const drawn = () => page.locator("canvas[data-detail=fine]").waitFor();
const signIn = async (name) => {
  await type(page.locator("input").nth(0), name);
  await type(page.locator("input").nth(1), password);
  await page.keyboard.press("Enter");
  await page.waitForSelector("nav");
};

await page.goto(address);
await inBoth("setup", () => page.waitForSelector("h1"));
await type(page.locator("input").nth(0), code);
await type(page.locator("input").nth(1), "anna");
await type(page.locator("input").nth(2), password);
await page.keyboard.press("Enter");
await page.waitForSelector("nav");
await press(link("Accounts"));
await page.waitForSelector("tbody tr");
await type(page.locator("input[pattern]"), "eve");
await choose("Role", "examiner");
await type(page.locator("input[minlength]").first(), password);
await page.keyboard.press("Enter");
await page.waitForSelector("tbody tr:nth-child(2)");
await inBoth("accounts", () => page.waitForSelector("tbody tr:nth-child(2)"));
for (const [name, title] of [["station", "Station"], ["audit", "Audit log"]]) {
  await press(link(title));
  await page.waitForSelector("tbody tr");
  await inBoth(name, () => page.waitForSelector("tbody tr"));
}
await press(button("Sign out"));
await inBoth("sign_in", () => page.waitForSelector("input"));
await signIn("eve");

// The first case; its number is no markup.
await press(link("At the table"));
await inBoth("ready", () => page.locator("img.preview[src]").waitFor());
await press(page.getByText("Focus and exposure", { exact: true }), " ");
await look("ready_focus");
await type(page.locator("input[maxlength='64']"), "2026-<b>0042</b>");
await page.keyboard.press("Enter");
await state("Photographing");
await page.waitForSelector(".dome .taken");
await look("scanning_en");
await state("Your turn");
await inBoth("turn_over", () => page.locator("button.main").waitFor());
await press(button("It lies as asked: go on"));
await state("Ready");
await page.waitForSelector("li .tag.building");
await look("building_en");

// The second meanwhile, with a stop.
await type(page.locator("input[maxlength='64']"), "2026-0043");
await page.keyboard.press("Enter");
await state("Photographing");
await page.waitForSelector(".dome .taken");
await press(button("Emergency stop"));
await state("Stopped");
await inBoth("stopped", () => state(/Stopped|Angehalten/));
await press(button("Try again"));
await page.getByText("emergency stop pressed").first().waitFor();
await look("stop_still_pressed_en");
await press(button("Release the stop"));
await press(button("Try again"));
await state("Your turn");
await look("goes_on_en");
await press(button("It lies as asked: go on"));
await state("Photographing");
await state("Your turn");
await press(button("Give this scan up"));
await look("give_up_en");
await press(button("No"));
await press(button("It lies as asked: go on"));
await state("Ready");
await look("two_cases_en");

await press(link("2026-0043"));
await page.locator("main .tag.building").waitFor();
await look("case_building_en");
await press(link("Cases"));
await press(link("2026-<b>0042</b>"));
await slider(1).waitFor();
await drawn();
await inBoth("result", async () => (await slider(1).waitFor(), await drawn()));
await reach(slider(1));
for (let i = 0; i < 15; ++i) await page.keyboard.press("ArrowRight");
await drawn();
await look("result_changed_en");
await press(button("Most likely face"));
await choose("Left", "Variant leaner");
await choose("Right", "Variant fuller");
await page.waitForTimeout(1500);
await look("variants_en");
await choose("Left", "Skull, fitted");
await choose("Right", "Face, coloured");
await choose("Show", "overlaid");
await reach(slider(0));
for (let i = 0; i < 10; ++i) await page.keyboard.press("ArrowLeft");
await page.waitForTimeout(1500);
await look("overlaid_en");
await choose("Left", "Skull as");
await page.waitForTimeout(4000);
await look("scanned_en");
await press(page.getByText("Measure", { exact: true }), " ");
await press(button("Mark the middle"));
await reach(page.locator("canvas"));
for (let i = 0; i < 3; ++i) await page.keyboard.press("ArrowRight");
await press(button("Mark the middle"));
const measured = await page.getByText("Distance:").textContent();
await press(page.getByText("Soft tissue at the landmarks", { exact: true }), " ");
await look("landmarks_en");

await reach(link("Open the report"));
const opened = context.waitForEvent("page");
await page.keyboard.press("Enter");
const report = await opened;
await report.waitForSelector("h1");
// Files of results open in a sandbox, where axe can't work either: it reads a copy.
const copy = await context.newPage();
await copy.setContent(await (await context.request.get(report.url())).text());
await report.screenshot({ path: join(folder, "report_sandboxed.png") });
await look("report", copy);
await report.close();
await copy.close();
await type(page.locator("textarea"), "looked at");
await press(button("Approve and sign off"));
await page.waitForSelector(".note.good");
await inBoth("approved", async () => (await slider(1).waitFor(), await drawn()));
await press(link("Cases"));
await page.locator("tbody .tag.done").nth(1).waitFor();
await inBoth("cases", () => page.waitForSelector("tbody tr"));
await press(button("Sign out"));

console.log(`measured with the keyboard: ${measured}`);
console.log(`axe: ${found.length} violations in ${views} views; requests to elsewhere: ${elsewhere}`);
for (const line of [...found, ...new Set(complaints)]) console.log(`  ${line}`);
await browser.close();
process.exit(found.length + elsewhere + complaints.length > 0 ? 1 : 0);
