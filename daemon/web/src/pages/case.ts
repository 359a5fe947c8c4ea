// One case: what is being made of it, what has been made, and what an examiner does with it.
import { fileAddress, get, send, type ArtifactFile, type Job, type SignIn, type WholeCase } from "../api";
import { fill, h } from "../dom";
import { facesPart } from "../faces";
import { live } from "../live";
import { field, form, notice, stationSays, tag } from "../parts";
import { deliveryPart, onTheirWay } from "./delivery";
import { bytes, duration, moment, number, t, word } from "../text";

interface CaseFigures {
  model?: { card?: string; subjects?: number };
  warnings?: string[];
  tissue?: { name: string; depth_mm: number; sd_mm: number; model_mean_mm: number }[];
  anatomical_from_input?: number[][];
}

/** Of each step the job appointed last; what was made of an older result is not shown beside a newer one. */
function current(jobs: Job[]): Job[] {
  const last = new Map<string, Job>();
  for (const job of jobs) if ((last.get(job.step)?.id ?? 0) < job.id) last.set(job.step, job);
  const present = new Set([...last.values()].map((job) => job.id));
  return [...last.values()].filter((job) => Object.values(job.inputs).every((id) => present.has(id))).sort((a, b) => a.id - b.id);
}

function stepsPart(whole: WholeCase, who: SignIn, again: () => void): HTMLElement {
  const said = notice();
  const act = (path: string) => send("POST", path).then(again, said.bad);
  const mayRetry = ["operator", "examiner", "administrator"].includes(who.role);
  const mayCancel = ["examiner", "administrator"].includes(who.role);
  const row = (job: Job) => {
    const running = live.station?.job?.id === job.id ? live.station.job : undefined;
    return h(
      "li",
      {},
      h("strong", {}, word("step", job.step)),
      running && h("progress", { max: 1, value: running.fraction, "aria-label": word("step", job.step) }),
      job.state === "done" && job.seconds > 0 && h("span", { class: "soft" }, t("job.took", { time: duration(job.seconds) })),
      tag("job", job.state),
      job.error && h("p", { class: "note bad" }, stationSays(job.error)),
      job.state === "failed" && job.log && h("details", {}, h("summary", {}, t("job.log")), h("pre", { tabindex: 0 }, job.log)),
      mayRetry && job.step !== "scan" && ["failed", "cancelled"].includes(job.state) && h("button", { onclick: () => act(`/jobs/${job.id}/retry`) }, t("job.retry")),
      mayCancel && job.step !== "scan" && ["waiting", "running"].includes(job.state) && h("button", { onclick: () => act(`/jobs/${job.id}/cancel`) }, t("job.cancel")),
    );
  };
  return h(
    "section",
    { class: "card" },
    h("h2", {}, t("result.steps")),
    whole.seconds_left !== undefined && h("p", {}, t("cases.left", { time: duration(whole.seconds_left) })),
    h("ul", { class: "plain" }, current(whole.jobs).map(row)),
    said.place,
  );
}

function signOffPart(whole: WholeCase, face: Job | undefined, who: SignIn, again: () => void): HTMLElement {
  const examiner = who.role === "examiner";
  const note = h("textarea", { maxlength: 2000, rows: 2 });
  const reason = h("input", { maxlength: 500, required: true });
  const approve = async () => (await send("POST", `/cases/${whole.id}/approval`, { job: face?.id, note: note.value }), again());
  const hold = async () => (await send("PUT", `/cases/${whole.id}/hold`, { reason: reason.value }), again());
  const letGo = async () => (await send("PUT", `/cases/${whole.id}/hold`, { reason: null }), again());
  const done = face?.state === "done";
  return h(
    "section",
    { class: "card" },
    done && h("div", { class: "row" }, h("a", { class: "button", href: fileAddress(face.id, "report.html"), target: "_blank", rel: "noopener" }, t("result.report")), h("a", { class: "button", href: fileAddress(face.id, "report.pdf"), target: "_blank", rel: "noopener" }, t("result.pdf"))),
    done && (face.approved
      ? h("p", { class: "note good" }, t("result.approved", { by: face.approved.by, time: moment(face.approved.time) }), face.approved.note && h("span", {}, ` ${face.approved.note}`))
      : h("p", { class: "soft" }, t("result.not_approved"))),
    done && examiner && !face.approved && form([field(t("result.approve_note"), note)], t("result.approve"), "main", approve),
    deliveryPart(whole, who, again),
    whole.hold !== undefined && h("p", { class: "note" }, t("result.held", { reason: whole.hold })),
    examiner && (whole.hold !== undefined ? form([], t("result.let_go"), "", letGo) : h("details", {}, h("summary", {}, t("result.hold")), form([field(t("result.hold_why"), reason)], t("result.hold"), "", hold))),
  );
}

function rerunPart(whole: WholeCase, again: () => void): HTMLElement {
  const sex = h("select", {}, ["unknown", "male", "female"].map((s) => h("option", { value: s }, word("result", s))));
  const age = h("input", { type: "number", min: 0, max: 120 });
  const bmi = h("input", { type: "number", min: 10, max: 60, step: 0.1 });
  const act = async () => {
    const options: Record<string, unknown> = {};
    if (sex.value !== "unknown") options.sex = sex.value;
    if (age.value) options.age_years = Number(age.value);
    if (bmi.value) options.bmi = Number(bmi.value);
    await send("POST", `/cases/${whole.id}/rerun`, { step: "approximate", options });
    again();
  };
  return h(
    "details",
    { class: "card" },
    h("summary", {}, t("result.rerun")),
    h("p", { class: "soft" }, t("result.rerun_help")),
    form([field(t("result.sex"), sex), field(t("result.age"), age), field(t("result.bmi"), bmi)], t("result.rerun_go"), "", act),
  );
}

function landmarksPart(figures: CaseFigures): HTMLElement {
  const head = h("tr", {}, h("th", { scope: "col" }, t("result.landmark")), ["result.depth", "result.sd", "result.model_mean"].map((k) => h("th", { scope: "col", class: "number" }, t(k as "result.depth"))));
  const rows = (figures.tissue ?? []).map((l) => h("tr", {}, h("th", { scope: "row" }, l.name), [l.depth_mm, l.sd_mm, l.model_mean_mm].map((v) => h("td", { class: "number" }, number(v, 1)))));
  return h("details", { class: "card" }, h("summary", {}, t("result.landmarks")), h("div", { class: "scroll", tabindex: 0 }, h("table", {}, h("thead", {}, head), h("tbody", {}, rows))));
}

export function casePage(place: HTMLElement, who: SignIn, argument: string): () => void {
  const said = notice();
  const head = h("div", { class: "row" });
  const damage = h("div");
  const result = h("div");
  const below = h("div", { class: "columns" });
  fill(place, head, said.place, damage, result, below);
  let shownFace = 0;
  let endFaces = () => {};
  let ended = false;
  let key = "";
  let moving = false;

  async function showFaces(face: Job, skull: Job | undefined): Promise<HTMLElement[]> {
    const [{ files }, figures] = await Promise.all([
      get<{ files: ArtifactFile[] }>(`/jobs/${face.id}/files`),
      fetch(fileAddress(face.id, "case.json")).then<CaseFigures>((answer) => answer.json()).catch((): CaseFigures => ({})),
    ]);
    if (ended) return [];
    const faces = facesPart(face, skull, files, figures.anatomical_from_input);
    endFaces = faces.end;
    const about = h(
      "section",
      { class: "card" },
      h("h2", {}, t("result.warnings")),
      (figures.warnings ?? []).map((w) => h("p", { class: "note", lang: "en" }, w)),
      figures.model?.card && h("p", { lang: "en" }, figures.model.card),
    );
    fill(result, faces.element);
    const all = h("details", { class: "card" }, h("summary", {}, t("result.files")), h("ul", { class: "plain" }, files.map((f) => h("li", {}, h("a", { href: fileAddress(face.id, f.path), download: f.path.split("/").pop() }, f.path), h("span", { class: "soft" }, bytes(f.bytes))))));
    return [about, landmarksPart(figures), all];
  }

  let extras: HTMLElement[] = [];
  async function look(): Promise<void> {
    const whole = await get<WholeCase>(`/cases/${argument}`);
    if (ended) return;
    moving = onTheirWay(whole);
    const jobs = current(whole.jobs);
    const face = jobs.find((job) => job.step === "approximate");
    const skull = jobs.find((job) => job.step === "reconstruct" && job.state === "done");
    fill(head, h("h1", {}, whole.number), tag("case.state", whole.state), h("span", { class: "soft" }, moment(whole.created)));
    fill(damage, (whole.damage ?? []).length > 0 && h("div", { class: "note bad", role: "alert" }, h("p", {}, t("result.damaged")), h("ul", {}, whole.damage?.map((d) => h("li", {}, stationSays(d))))));
    if (face?.state === "done" && !whole.removed && shownFace !== face.id) {
      shownFace = face.id;
      endFaces();
      extras = await showFaces(face, skull);
    }
    const again = () => void look().catch(said.bad);
    const history = h("details", { class: "card" }, h("summary", {}, t("result.history")), h("ul", { class: "plain" }, whole.events.map((e) => h("li", {}, h("span", { class: "soft" }, moment(e.time)), stationSays(e.what)))));
    const mayRerun = who.role === "examiner" && skull !== undefined && !whole.removed;
    fill(below, h("div", {}, signOffPart(whole, face, who, again), extras), h("div", {}, stepsPart(whole, who, again), mayRerun && rerunPart(whole, again), history));
  }
  const end = live.listen(() => {
    const job = live.station?.job;
    const now = `${live.station?.state} ${job?.id} ${job?.case === Number(argument) ? Math.floor(job.fraction * 50) : ""}`;
    if (now === key) return;
    key = now;
    // What somebody is typing must not be taken away.
    if (!below.contains(document.activeElement)) void look().catch(said.bad);
  });
  // Deliveries are not among the station's news.
  const timer = window.setInterval(() => {
    if (moving && !below.contains(document.activeElement)) void look().catch(said.bad);
  }, 5000);
  void look().catch(said.bad);
  return () => {
    ended = true;
    clearInterval(timer);
    end();
    endFaces();
  };
}
