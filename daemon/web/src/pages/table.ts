// What stands beside the table: ready, photographing, turn over, stopped.
import { ask, get, send, type Case, type ScanView, type SignIn, type Station } from "../api";
import { coverageDome } from "../dome";
import { fill, h, setText } from "../dom";
import { live } from "../live";
import { caseLink, field, notice, stationSays, sure, tag, words } from "../parts";
import { duration, moment, number, says, t, word, type Key } from "../text";

const idle = ["ready", "building", "result"];

/** What the person has to do, in this language where the station's own words are known. */
function instruction(station: Station): string {
  const message = station.message;
  if (station.state === "turn-over") {
    if (message.startsWith("The scan goes on")) return t("says.continued");
    if (message.includes("upside down")) return t("says.over");
    if (message.includes("on its back")) return t("says.back");
    if (message.includes("upright")) return t("says.upright");
    return says(message);
  }
  return t(`do.${idle.includes(station.state) ? "ready" : station.state}` as Key);
}

/** Said by the station beyond what the state says by itself. */
function remark(station: Station): string {
  const known = ["Lay the next specimen", "is being photographed", "is saved"];
  if (!idle.includes(station.state) || known.some((part) => station.message.includes(part))) return "";
  return says(station.message);
}

function stateBox(station: Station): HTMLElement {
  const kind = { fault: "bad", stopped: "bad", scanning: "busy", starting: "busy", "turn-over": "busy" }[station.state as string] ?? "good";
  return h("div", { class: `state ${kind}`, role: "status" }, h("h1", {}, word("state", station.state)), h("div", {}, station.state === "fault" && h("p", {}, stationSays(station.message)), h("p", {}, instruction(station))));
}

interface Part {
  element: HTMLElement;
  /** Called whenever the station has said something. */
  update(station: Station): void;
  end(): void;
}

function previewPart(station: Station): Part {
  const image = h("img", { class: "preview", alt: t("table.preview_none") });
  const figures = h("div");
  // Where focus is best is seen by turning the lens: the ring is right where the bar was longest.
  const sharpest = new Map<string, number>();
  const verdict = h("div", { "aria-live": "polite" });
  let camera = station.cameras[0]?.id ?? "";
  let address = "";
  let ended = false;
  const choose = h(
    "select",
    { onchange: () => ((camera = choose.value), void look()) },
    station.cameras.map((c) => h("option", { value: c.id }, c.id)),
  );
  async function look(): Promise<void> {
    const asked = camera;
    const response = await ask("GET", `/station/preview?camera=${encodeURIComponent(asked)}`);
    const about = JSON.parse(response.headers.get("X-Preview") ?? "{}");
    const picture = URL.createObjectURL(await response.blob());
    if (ended || asked !== camera) return URL.revokeObjectURL(picture);
    if (address) URL.revokeObjectURL(address);
    image.src = address = picture;
    image.alt = t("table.preview_alt", { camera: asked });
    const best = Math.max(about.sharpness, sharpest.get(asked) ?? 0);
    sharpest.set(asked, best);
    const [darkest, brightest] = about.mean_level_allowed;
    const light = about.mean_level < darkest ? "table.too_dark" : about.mean_level > brightest ? "table.too_bright" : "table.light_good";
    const bar = (label: string, bounds: object) => h("label", {}, label, h("meter", bounds as Record<string, unknown>));
    fill(
      figures,
      bar(t("table.sharp", { percent: number(best > 0 ? (100 * about.sharpness) / best : 0), value: number(about.sharpness, 2) }), { min: 0, max: 1, low: 0.8, optimum: 1, value: best > 0 ? about.sharpness / best : 0 }),
      bar(`${t("table.light", { value: number(about.mean_level) })} ${t(light)} ${t("table.clipped", { value: number(about.clipped_percent, 1) })}`, { min: 0, max: 255, low: darkest, high: brightest, optimum: (darkest + brightest) / 2, value: about.mean_level }),
    );
    const text = about.complaint ? `${t("table.bad")} ${says(about.complaint)}` : t("table.good");
    if (verdict.textContent !== text) fill(verdict, h("p", { class: about.complaint ? "note" : "note good" }, text));
  }
  async function keepLooking(): Promise<void> {
    while (!ended) {
      // The camera is busy now and then: the last picture stays.
      await look().catch((error) => ended || address || fill(verdict, h("p", { class: "soft", lang: "en" }, words(error))));
      await new Promise((resolve) => setTimeout(resolve, 1000));
    }
  }
  void keepLooking();
  const help = h("details", {}, h("summary", {}, t("table.focus_help")), h("p", {}, t("table.focus_how")), h("p", {}, t("table.light_how")));
  const element = h("section", { class: "card" }, station.cameras.length > 1 && field(t("table.preview"), choose), image, verdict, figures, help);
  return { element, update: () => {}, end: () => ((ended = true), address && URL.revokeObjectURL(address)) };
}

function startPart(station: Station, who: SignIn): Part {
  const said = notice();
  const caseNumber = h("input", { maxlength: 64, autocomplete: "off", autofocus: true, "aria-describedby": "number-help" });
  const act = (path: string, body?: unknown) => send("POST", `/station/${path}`, body).then(said.clear, said.bad);
  const may = ["operator", "examiner", "administrator"].includes(who.role);
  const buttons: HTMLElement[] = [];
  if (may && station.state === "turn-over") buttons.push(h("button", { class: "main big", autofocus: true, onclick: () => act("confirm") }, t("table.confirm")));
  if (may && station.state === "fault") buttons.push(h("button", { class: "main big", onclick: () => act("reset") }, t("table.reset")));
  if (may && (station.state === "scanning" || station.state === "turn-over")) {
    const cancel = async () => (await sure(t("table.cancel_sure"), t("table.cancel"))) && act("cancel");
    buttons.push(h("button", { class: "danger", onclick: cancel }, t("table.cancel")));
  }
  if (may && station.state === "result") buttons.push(h("button", { onclick: () => act("cancel") }, t("table.seen")));
  const start = may && idle.includes(station.state)
    ? h(
        "form",
        // A barcode scanner types the number and presses Enter.
        { onsubmit: (e: Event) => (e.preventDefault(), void act("start", { case_number: caseNumber.value.trim() || null })) },
        field(t("table.number"), caseNumber),
        h("p", { class: "soft", id: "number-help" }, t("table.number_help")),
        h("button", { class: "main big" }, t("table.start")),
      )
    : null;
  const element = h("section", { class: "card" }, start, h("div", { class: "row" }, buttons), said.place);
  return { element, update: () => {}, end: () => {} };
}

function scanPart(station: Station): Part {
  const all = station.passes * station.cameras.length * station.views_per_ring;
  const bar = h("progress", { max: 1, "aria-label": t("state.scanning") });
  const count = h("p", { "aria-live": "off" });
  const dome = h("div");
  const bad = h("div", { "aria-live": "polite" });
  let views: ScanView[] = [];
  let taken = -1;
  async function look(now: Station): Promise<void> {
    const fraction = now.scan?.fraction ?? 0;
    bar.value = fraction;
    const roughly = Math.floor(fraction * all);
    if (roughly !== taken) {
      taken = roughly;
      views = (await get<{ views: ScanView[] }>("/station/scan").catch(() => ({ views }))).views;
      const pass = views.length > 0 ? views[views.length - 1].pass : 0;
      fill(dome, coverageDome(station, views, pass));
      const rejected = [...new Set(views.filter((v) => v.rejected).map((v) => `${v.camera}: ${says(v.rejected ?? "")}`))];
      fill(bad, rejected.length > 0 && h("div", { class: "note" }, t("table.rejected"), h("ul", {}, rejected.slice(-4).map((r) => h("li", {}, r)))));
    }
    setText(count, `${t("table.progress", { percent: number(100 * fraction) })} · ${t("table.views", { done: views.length, all })}`);
  }
  void look(station);
  return { element: h("section", { class: "card" }, bar, count, dome, bad), update: (now) => void look(now), end: () => {} };
}

function casesPart(): Part {
  const list = h("ul", { class: "plain" });
  let key = "";
  async function look(station: Station): Promise<void> {
    const now = `${station.state} ${station.job?.id} ${station.scan?.case} ${Math.floor((station.job?.seconds ?? 0) / 20)}`;
    if (now === key) return;
    key = now;
    const { cases } = await get<{ cases: Case[] }>("/cases?most=6");
    const row = (c: Case) =>
      h("li", {}, caseLink(c), c.seconds_left !== undefined && h("span", { class: "soft" }, t("cases.left", { time: duration(c.seconds_left) })), tag("case.state", c.state));
    fill(list, cases.map(row));
  }
  const bar = h("progress", { max: 1, hidden: true, "aria-label": t("table.being_built") });
  const step = h("p", { class: "soft" });
  const update = (station: Station) => {
    void look(station).catch(() => {});
    bar.hidden = station.job === undefined;
    bar.value = station.job?.fraction ?? 0;
    setText(step, station.trouble !== undefined ? says(station.trouble) : (station.job ? `${word("step", station.job.step)} · ${number(100 * station.job.fraction)} %` : ""));
  };
  return { element: h("section", { class: "card" }, h("h2", {}, t("table.latest")), bar, step, list), update, end: () => {} };
}

function handsPart(): HTMLElement {
  const hand = (name: string, label: Key) => h("button", { onclick: () => send("POST", "/station/hand", { hand: name }).catch(() => {}) }, t(label));
  return h(
    "section",
    { class: "card" },
    h("h2", {}, t("table.simulated")),
    h("div", { class: "row" }, hand("press", "table.press"), hand("hold", "table.hold"), hand("press-stop", "table.estop"), hand("release-stop", "table.release")),
  );
}

export function tablePage(place: HTMLElement, who: SignIn): () => void {
  let parts: Part[] = [];
  let shown = "";
  const state = h("div");
  const says = h("div", { "aria-live": "polite" });
  const body = h("div", { class: "columns" });
  const log = h("div", { class: "log" });
  let logged = -1;
  fill(place, state, says, body, h("details", { class: "card" }, h("summary", {}, t("table.log")), log));
  function update(): void {
    const station = live.station;
    if (station === null) return;
    const key = `${station.state} ${station.simulated}`;
    if (key !== shown) {
      shown = key;
      for (const part of parts) part.end();
      const scanning = station.state === "scanning" || station.state === "turn-over";
      const left = scanning ? scanPart(station) : previewPart(station);
      parts = [left, startPart(station, who), casesPart()];
      const hands = station.simulated && ["operator", "examiner", "administrator"].includes(who.role);
      fill(body, h("div", {}, left.element), h("div", {}, parts[1].element, parts[2].element, hands && handsPart()));
      (body.querySelector("[autofocus]") as HTMLElement | null)?.focus({ preventScroll: true });
    }
    const instructionNow = `${station.state} ${station.message}`;
    if (state.dataset.of !== instructionNow) {
      state.dataset.of = instructionNow;
      fill(state, stateBox(station));
      const more = station.message.includes("is saved") && idle.includes(station.state) ? t("table.safe") : remark(station);
      fill(says, more && h("p", { class: station.signal === "attention" ? "note" : "note good" }, more));
    }
    for (const part of parts) part.update(station);
    if (live.log.length !== logged) {
      logged = live.log.length;
      fill(log, [...live.log].reverse().map((line) => h("p", {}, h("span", { class: "soft" }, `${moment(line.time)} `), stationSays(line.words))));
    }
  }
  const end = live.listen(update);
  update();
  return () => {
    end();
    for (const part of parts) part.end();
  };
}
