// The console: who is here, which page, and the frame around it.
import { get, onSignedOut, send, useToken, type Role, type SignIn } from "./api";
import { fill, h } from "./dom";
import { live } from "./live";
import { accountsPage } from "./pages/accounts";
import { auditPage } from "./pages/audit";
import { casePage } from "./pages/case";
import { casesPage } from "./pages/cases";
import { checkPage } from "./pages/check";
import { setUpPage, signInPage } from "./pages/sign_in";
import { tablePage } from "./pages/table";
import { currentLanguage, t, useLanguage, usualLanguage, word, type Key } from "./text";

/** A page fills its element and returns what has to be done when it is left. */
export type Page = (place: HTMLElement, who: SignIn, argument: string) => () => void;

const all: Role[] = ["viewer", "operator", "examiner", "administrator", "auditor"];
const pages: { path: string; title: Key; roles: Role[]; page: Page; hidden?: boolean }[] = [
  { path: "table", title: "nav.table", roles: all, page: tablePage },
  { path: "cases", title: "nav.cases", roles: all, page: casesPage },
  { path: "case", title: "nav.cases", roles: all, page: casePage, hidden: true },
  { path: "station", title: "nav.station", roles: ["operator", "examiner", "administrator", "auditor"], page: checkPage },
  { path: "accounts", title: "nav.accounts", roles: all, page: accountsPage },
  { path: "audit", title: "nav.audit", roles: ["administrator", "auditor"], page: auditPage },
];

const root = document.getElementById("console") as HTMLElement;
let who: SignIn | null = null;
let leave: () => void = () => {};

function frame(signIn: SignIn): HTMLElement {
  const lost = h("div", { role: "status", class: "note bad", hidden: true }, t("nav.lost"));
  live.listen(() => (lost.hidden = live.connected));
  const [path] = address();
  const links = pages
    .filter((page) => !page.hidden && page.roles.includes(signIn.role))
    .map((page) => {
      const here = page.path === path || (page.path === "cases" && path === "case");
      return h("a", { href: `#/${page.path}`, "aria-current": here ? "page" : null }, t(page.title));
    });
  const place = h("main", { id: "main", tabindex: "-1" });
  fill(
    root,
    h("a", { class: "skip", href: "#main", onclick: (e: Event) => (e.preventDefault(), place.focus()) }, t("nav.skip")),
    h(
      "header",
      {},
      h("nav", { "aria-label": t("nav.main") }, links),
      h("span", { class: "who" }, `${signIn.account} · ${word("role", signIn.role)}`),
      languageButton(),
      h("button", { onclick: signOut }, t("nav.sign_out")),
    ),
    lost,
    place,
  );
  return place;
}

export function languageButton(): HTMLElement {
  const other = currentLanguage() === "en" ? "de" : "en";
  return h(
    "button",
    { lang: other, onclick: () => (useLanguage(other), void show()) },
    t("nav.language"),
  );
}

async function signOut(): Promise<void> {
  await send("DELETE", "/session").catch(() => {});
  who = null;
  void show();
}

function address(): [string, string] {
  const [path, argument] = location.hash.replace(/^#\//, "").split("/");
  return [path || "table", argument ?? ""];
}

function enter(signIn: SignIn): void {
  who = useToken(signIn);
  void live.start().then(show);
}

async function show(): Promise<void> {
  leave();
  leave = () => {};
  if (who === null) {
    live.stop();
    const setup = await get<{ needed: boolean; station: string }>("/setup");
    document.title = `${setup.station} · ${t("app.name")}`;
    const place = h("main", {});
    fill(root, place);
    (setup.needed ? setUpPage : signInPage)(place, setup.station, enter);
    return;
  }
  const signIn = who;
  const [path, argument] = address();
  const page = pages.find((p) => p.path === path && p.roles.includes(signIn.role)) ?? pages[0];
  document.title = `${t(page.title)} · ${live.station?.station ?? t("app.name")}`;
  leave = page.page(frame(signIn), signIn, argument);
}

onSignedOut(() => {
  if (who === null) return;
  who = null;
  void show();
});
window.addEventListener("hashchange", () => void show().then(() => document.getElementById("main")?.focus()));
useLanguage(usualLanguage());
get<SignIn>("/session").then(enter, () => void show());
