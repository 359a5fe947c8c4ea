import { get, type Case } from "../api";
import { fill, h } from "../dom";
import { caseLink, field, notice, tag } from "../parts";
import { duration, moment, t } from "../text";

const shownAtOnce = 25;

export function casesPage(place: HTMLElement): () => void {
  const search = h("input", { type: "search", oninput: () => ((skip = 0), later()) });
  const rows = h("tbody");
  const count = h("p", { class: "soft", role: "status" });
  const said = notice();
  let skip = 0;
  let waiting = 0;
  let asked = 0;
  const newer = h("button", { onclick: () => ((skip = Math.max(0, skip - shownAtOnce)), void look()) }, t("cases.newer"));
  const older = h("button", { onclick: () => ((skip += shownAtOnce), void look()) }, t("cases.more"));
  function later(): void {
    clearTimeout(waiting);
    waiting = window.setTimeout(() => void look(), 200);
  }
  function stateOf(c: Case): (Node | false)[] {
    return [
      tag("case.state", c.state),
      c.seconds_left !== undefined && h("span", { class: "soft" }, ` ${t("cases.left", { time: duration(c.seconds_left) })}`),
      c.hold !== undefined && h("span", { class: "tag" }, t("cases.hold")),
      c.verified !== undefined && h("span", { class: "tag ok" }, t("cases.delivered")),
    ];
  }
  async function look(): Promise<void> {
    const mine = ++asked;
    const found = await get<{ cases: Case[]; all: number }>(`/cases?most=${shownAtOnce}&skip=${skip}&search=${encodeURIComponent(search.value.trim())}`);
    if (mine !== asked) return;
    fill(rows, found.cases.map((c) => h("tr", {}, h("td", {}, caseLink(c)), h("td", {}, moment(c.created)), h("td", {}, stateOf(c)))));
    fill(count, found.all === 0 && search.value ? t("cases.none") : t("cases.count", { shown: found.cases.length, all: found.all }));
    newer.disabled = skip === 0;
    older.disabled = skip + found.cases.length >= found.all;
  }
  const head = ["cases.number", "cases.created", "cases.state"] as const;
  fill(
    place,
    h("h1", {}, t("cases.title")),
    h("div", { class: "card" }, field(t("cases.search"), search), count, said.place, h("div", { class: "scroll", tabindex: 0 }, h("table", {}, h("thead", {}, h("tr", {}, head.map((k) => h("th", { scope: "col" }, t(k))))), rows)), h("p", {}), h("div", { class: "row" }, newer, older)),
  );
  void look().catch(said.bad);
  const timer = window.setInterval(() => void look().catch(said.bad), 15000);
  return () => (clearInterval(timer), clearTimeout(waiting));
}
