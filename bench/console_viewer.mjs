// How soon a finished case's face is on the screen of a real Chromium, and how soon again after a
// slider's step: until the last pixel is drawn, with software rendering. Prints medians of ROUNDS
// reloads and of twice as many steps each.
//   node bench/console_viewer.mjs ADDRESS NAME PASSWORD CASE [ROUNDS]
// A case with a head of 300,000 triangles: tests/console/prepared_steps.mjs (docs/console.md).
import { createRequire } from "node:module";
import { loadavg } from "node:os";

const require = createRequire(new URL("../daemon/web/package.json", import.meta.url));
const { chromium } = require("playwright-core");
const [address, name, password, id, rounds = 7] = process.argv.slice(2);

const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
});
const context = await browser.newContext({ ignoreHTTPSErrors: true, viewport: { width: 1024, height: 768 } });
const page = await context.newPage();
page.on("pageerror", (error) => console.log(String(error)));
await page.goto(address);
await page.locator("input").nth(0).fill(name);
await page.locator("input").nth(1).fill(password);
await page.keyboard.press("Enter");
await page.waitForSelector("nav");
await page.goto(`${address}/#/case/${id}`);
await page.locator("input[type=range]").nth(1).waitFor({ timeout: 120000 });

// Since the page was asked for: when a frame with triangles of the face was complete. The canvas
// tells of each frame; reading a pixel waits for all of it.
await page.addInitScript(() => {
  globalThis.frames = [];
  document.addEventListener(
    "drawn",
    ({ target }) => {
      const gl = target.getContext("webgl2");
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      globalThis.frames.push({ at: performance.now(), shows: target.dataset.shows ?? "", detail: target.dataset.detail });
    },
    true,
  );
});
const median = (values) => values.sort((a, b) => a - b)[Math.floor(values.length / 2)].toFixed(0);
const shown = [];
const stepped = [];
for (let round = 0; round < Number(rounds); ++round) {
  await page.reload();
  await page.locator("input[type=range]").nth(1).waitFor({ timeout: 120000 });
  const times = () =>
    page.evaluate(() => {
      const { frames } = globalThis;
      return [
        frames.find((f) => f.shows.includes("face"))?.at,
        frames.find((f) => f.shows.includes("face") && f.detail === "fine")?.at,
        frames.find((f) => f.shows === "fitted face" && f.detail === "fine")?.at,
      ];
    });
  while ((await times()).includes(undefined)) await page.waitForTimeout(50);
  shown.push(await times());
  for (let i = 0; i < 2; ++i) {
    stepped.push(
      await page.evaluate(
        (value) =>
          new Promise((resolve) => {
            const slider = document.querySelectorAll("input[type=range]")[1];
            const begun = performance.now();
            document.addEventListener("drawn", () => resolve(performance.now() - begun), { once: true, capture: true });
            slider.value = String(value);
            slider.dispatchEvent(new Event("input"));
          }),
        0.4 * (i + 1),
      ),
    );
    await page.waitForTimeout(200);
  }
}
console.log(`load ${loadavg()[0].toFixed(1)}; medians of ${rounds} reloads`);
const part = (k) => median(shown.map((times) => times[k]));
console.log(`after the page was asked for: face on screen ${part(0)} ms, in every detail ${part(1)} ms, skull too ${part(2)} ms`);
console.log(`a slider's step ${median(stepped)} ms until it is drawn, longest ${Math.max(...stepped).toFixed(0)} ms`);
await browser.close();
