// Load on a running console: event streams that stay open and clients that browse. Prints how long
// answers took, whether every stream was told everything, and what the daemon's memory was.
//   node bench/console_load.mjs ADDRESS NAME PASSWORD [STREAMS CLIENTS SECONDS DAEMON-PID]
import { readFileSync } from "node:fs";
import https from "node:https";

const [address, name, password, streams = 200, clients = 20, seconds = 30, pid] = process.argv.slice(2);
const agent = new https.Agent({ keepAlive: true, rejectUnauthorized: false, maxSockets: 1000 });

function ask(method, path, headers = {}, body = undefined) {
  return new Promise((resolve, reject) => {
    const request = https.request(address + path, { method, agent, headers }, (response) => {
      let text = "";
      response.on("data", (part) => (text += part));
      response.on("end", () => resolve({ status: response.statusCode, headers: response.headers, text }));
    });
    request.on("error", reject);
    request.end(body);
  });
}

const memory = () => (pid ? readFileSync(`/proc/${pid}/status`, "utf8").match(/VmRSS:\s+(\d+)/)[1] / 1024 : NaN);
const json = { "Content-Type": "application/json", Origin: address };
const signIn = await ask("POST", "/api/v1/session", json, JSON.stringify({ name, password }));
if (signIn.status !== 201) throw new Error(`sign-in: ${signIn.status} ${signIn.text}`);
const cookie = { Cookie: signIn.headers["set-cookie"][0].split(";")[0] };
const before = memory();

const told = [];
for (let i = 0; i < Number(streams); ++i) {
  const mine = { bytes: 0, ended: false, events: 0 };
  told.push(mine);
  https.get(address + "/api/v1/events", { agent, headers: cookie }, (response) => {
    response.on("data", (part) => {
      mine.bytes += part.length;
      mine.events += String(part).split("event: ").length - 1;
    });
    response.on("end", () => (mine.ended = true));
  });
}
await new Promise((resolve) => setTimeout(resolve, 3000));
const paths = ["/", "/console.js", "/api/v1/station", "/api/v1/cases", "/api/v1/session", "/api/v1/cases?search=20", "/api/v1/station"];
const took = [];
const statuses = {};
const end = Date.now() + 1000 * Number(seconds);
async function browse(client) {
  for (let i = client; Date.now() < end; ++i) {
    const begun = performance.now();
    const { status } = await ask("GET", paths[i % paths.length], { ...cookie, "Accept-Encoding": "gzip" });
    took.push(performance.now() - begun);
    statuses[status] = (statuses[status] ?? 0) + 1;
    await new Promise((resolve) => setTimeout(resolve, 100 + 50 * Math.random()));  // a person looks
  }
}
await Promise.all(Array.from({ length: Number(clients) }, (_, i) => browse(i)));
took.sort((a, b) => a - b);
const at = (share) => took[Math.min(took.length - 1, Math.floor(share * took.length))].toFixed(1);
console.log(`${took.length} answers, by status ${JSON.stringify(statuses)}`);
console.log(`p50 ${at(0.5)} ms, p90 ${at(0.9)} ms, p99 ${at(0.99)} ms, longest ${at(1)} ms`);
const events = told.map((t) => t.events).sort((a, b) => a - b);
console.log(`${told.length} streams, ended ${told.filter((t) => t.ended).length}, events each ${events[0]} to ${events.at(-1)}`);
console.log(`daemon's memory: ${before.toFixed(0)} MiB before, ${memory().toFixed(0)} MiB now`);
process.exit(0);
