import { send, type SignIn } from "../api";
import { languageButton } from "../console";
import { fill, h } from "../dom";
import { field, form } from "../parts";
import { t } from "../text";

type Enter = (signIn: SignIn) => void;

const name = () => h("input", { name: "name", autocomplete: "username", required: true, autocapitalize: "none", spellcheck: "false" });

export function signInPage(place: HTMLElement, station: string, enter: Enter): void {
  const user = name();
  const password = h("input", { type: "password", autocomplete: "current-password", required: true });
  const fields = [field(t("sign.name"), user), field(t("sign.password"), password)];
  const act = async () => enter(await send<SignIn>("POST", "/session", { name: user.value, password: password.value }));
  fill(
    place,
    h("div", { class: "card narrow" }, h("h1", {}, `${station}: ${t("sign.title")}`), form(fields, t("sign.go"), "main", act), h("p", {}), languageButton()),
  );
  user.focus();
}

export function setUpPage(place: HTMLElement, station: string, enter: Enter): void {
  const code = h("input", { autocomplete: "one-time-code", required: true, autocapitalize: "characters", spellcheck: "false" });
  const user = name();
  const password = h("input", { type: "password", autocomplete: "new-password", minlength: 10, required: true });
  const fields = [field(t("setup.code"), code), field(t("sign.name"), user), field(t("setup.password"), password)];
  const act = async () =>
    enter(await send<SignIn>("POST", "/setup", { code: code.value.trim().toUpperCase(), name: user.value, password: password.value }));
  fill(
    place,
    h("div", { class: "card narrow" }, h("h1", {}, `${station}: ${t("setup.title")}`), h("p", {}, t("setup.why")), form(fields, t("setup.go"), "main", act), h("p", {}), languageButton()),
  );
  code.focus();
}
