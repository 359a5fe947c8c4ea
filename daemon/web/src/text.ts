// Every word of the console, from the message files. No sentence is put together from parts.
import de from "./messages/de.json";
import en from "./messages/en.json";
import stationDe from "./messages/station_de.json";

export type Language = "en" | "de";
export type Key = keyof typeof en;

const catalogues: Record<Language, Record<Key, string>> = { en, de };
let language: Language = "en";

export function currentLanguage(): Language {
  return language;
}

export function useLanguage(wanted: Language): void {
  language = wanted;
  document.documentElement.lang = wanted;
  localStorage.setItem("language", wanted);
}

export function usualLanguage(): Language {
  const kept = localStorage.getItem("language");
  if (kept === "en" || kept === "de") return kept;
  return navigator.language.startsWith("de") ? "de" : "en";
}

/** The message, with {name} filled in. */
export function t(key: Key, values: Record<string, string | number> = {}): string {
  return catalogues[language][key].replace(/\{(\w+)\}/g, (_, name) => String(values[name] ?? ""));
}

/** A message whose key is made of a word of the station's; the word itself where there is none. */
export function word(group: string, name: string): string {
  const key = `${group}.${name}`;
  return key in catalogues[language] ? catalogues[language][key as Key] : name;
}

/** What the station itself says, as patterns: its sentences have names, numbers and one another in them. */
const sentences = Object.entries(stationDe).map(([english, german]) => ({
  pattern: new RegExp(`^${english.replace(/[.*+?^$()|[\]\\]/g, "\\$&").replace(/\{(\w+)\}/g, "(?<$1>.+)")}$`, "s"),
  german,
}));

/** A sentence of the station's in this language; English where it is not known. */
export function says(text: string): string {
  if (language === "en") return text;
  for (const { pattern, german } of sentences) {
    const groups = pattern.exec(text)?.groups;
    if (groups !== undefined) return german.replace(/\{(\w+)\}/g, (_, name) => says(groups[name]));
    if (pattern.test(text)) return german;
  }
  return text;
}

export function number(value: number, digits = 0): string {
  return value.toLocaleString(language, { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

export function moment(iso: string): string {
  return new Date(iso).toLocaleString(language, { dateStyle: "medium", timeStyle: "short" });
}

/** "about 4 min" */
export function duration(seconds: number): string {
  const unit = (value: number, name: string) =>
    value.toLocaleString(language, { style: "unit", unit: name, unitDisplay: "short" });
  if (seconds < 90) return unit(Math.max(1, Math.round(seconds)), "second");
  if (seconds < 5400) return unit(Math.round(seconds / 60), "minute");
  return unit(Math.round(seconds / 3600), "hour");
}

export function bytes(value: number): string {
  const unit = value >= 1e9 ? "gigabyte" : value >= 1e6 ? "megabyte" : "kilobyte";
  const scale = { gigabyte: 1e9, megabyte: 1e6, kilobyte: 1e3 }[unit];
  return (value / scale).toLocaleString(language, {
    style: "unit",
    unit,
    unitDisplay: "short",
    maximumFractionDigits: 1,
  });
}
