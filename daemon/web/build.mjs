// Makes dist/ of src/: what the program embeds. `npm ci && npm run check && npm run build`.
// dist/SOURCES names the sources' sum, so that a test sees when dist/ is older than they are.
import { createHash } from "node:crypto";
import { copyFileSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { build } from "esbuild";

function filesBelow(folder) {
  return readdirSync(folder, { withFileTypes: true })
    .flatMap((e) => (e.isDirectory() ? filesBelow(join(folder, e.name)) : [join(folder, e.name)]))
    .sort();
}

await build({
  entryPoints: ["src/console.ts"],
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  legalComments: "inline",
  outfile: "dist/console.js",
});
await build({ entryPoints: ["src/console.css"], minify: true, outfile: "dist/console.css" });
copyFileSync("src/index.html", "dist/index.html");
copyFileSync("src/icon.svg", "dist/icon.svg");

const sum = createHash("sha256");
for (const file of ["package-lock.json", ...filesBelow("src")]) {
  sum.update(`${file}\n${readFileSync(file)}\n`);
}
writeFileSync("dist/SOURCES", sum.digest("hex") + "\n");
