import { get, send, useToken, type Account, type Role, type SignIn } from "../api";
import { fill, h } from "../dom";
import { field, form, notice } from "../parts";
import { moment, t, word } from "../text";

const roles: Role[] = ["viewer", "operator", "examiner", "administrator", "auditor"];

function roleChoice(chosen: Role, change?: (role: Role) => void, label?: string): HTMLSelectElement {
  const choice = h(
    "select",
    { "aria-label": label, onchange: () => change?.(choice.value as Role) },
    roles.map((role) => h("option", { value: role, selected: role === chosen }, word("role", role))),
  );
  return choice;
}

function ownPassword(): HTMLElement {
  const before = h("input", { type: "password", autocomplete: "current-password", required: true });
  const after = h("input", { type: "password", autocomplete: "new-password", minlength: 10, required: true });
  const said = notice();
  const act = async () => {
    useToken(await send<SignIn>("PUT", "/session/password", { old: before.value, new: after.value }));
    said.good(t("accounts.changed"));
  };
  return h("section", { class: "card" }, h("h2", {}, t("accounts.mine")), said.place, form([field(t("accounts.old"), before), field(t("accounts.new"), after)], t("accounts.change"), "", act));
}

export function accountsPage(place: HTMLElement, who: SignIn): () => void {
  const said = notice();
  const rows = h("tbody");
  const mayChange = who.role === "administrator";
  async function look(): Promise<void> {
    const { accounts } = await get<{ accounts: Account[] }>("/accounts");
    const change = (account: Account, what: unknown) => send("PATCH", `/accounts/${account.name}`, what).then(said.clear, said.bad).then(look);
    fill(
      rows,
      accounts.map((a) =>
        h(
          "tr",
          {},
          h("td", {}, a.name, a.disabled && h("span", { class: "tag cancelled" }, t("accounts.disabled"))),
          h("td", {}, mayChange ? roleChoice(a.role, (role) => void change(a, { role }), `${t("accounts.role")}: ${a.name}`) : word("role", a.role)),
          h("td", {}, moment(a.created)),
          mayChange && h("td", {}, h("button", { "aria-label": `${t(a.disabled ? "accounts.enable" : "accounts.disable")}: ${a.name}`, onclick: () => void change(a, { disabled: !a.disabled }) }, t(a.disabled ? "accounts.enable" : "accounts.disable"))),
        ),
      ),
    );
  }
  function addForm(): HTMLElement {
    const name = h("input", { pattern: "[A-Za-z0-9._\\-]{1,32}", required: true, autocomplete: "off", autocapitalize: "none" });
    const role = roleChoice("operator");
    const password = h("input", { type: "password", minlength: 10, autocomplete: "new-password", required: true });
    const act = async () => {
      await send("POST", "/accounts", { name: name.value, role: role.value, password: password.value });
      name.value = password.value = "";
      await look();
    };
    return h("section", { class: "card" }, h("h2", {}, t("accounts.add")), form([field(t("sign.name"), name), field(t("accounts.role"), role), field(t("setup.password"), password)], t("accounts.add_go"), "main", act));
  }
  const maySee = mayChange || who.role === "auditor";
  const head = [t("sign.name"), t("accounts.role"), t("accounts.created"), ...(mayChange ? [t("accounts.actions")] : [])];
  fill(
    place,
    h("h1", {}, t("accounts.title")),
    maySee && h("section", { class: "card" }, said.place, h("div", { class: "scroll", tabindex: 0 }, h("table", {}, h("thead", {}, h("tr", {}, head.map((k) => h("th", { scope: "col" }, k)))), rows))),
    mayChange && addForm(),
    ownPassword(),
  );
  if (maySee) void look().catch(said.bad);
  return () => {};
}
