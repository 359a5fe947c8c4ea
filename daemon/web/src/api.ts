// What the station is asked and told (daemon/http/openapi.json).

export type Role = "viewer" | "operator" | "examiner" | "administrator" | "auditor";

export interface SignIn {
  account: string;
  role: Role;
  csrf: string;
}

export type StationState =
  | "starting"
  | "ready"
  | "scanning"
  | "turn-over"
  | "building"
  | "result"
  | "fault"
  | "stopped";

export interface Status {
  state: StationState;
  signal: string;
  message: string;
  scan?: { case: number; fraction: number; stage: string };
  job?: { id: number; case: number; step: string; fraction: number; stage: string; seconds: number };
  trouble?: string;
}

export interface Station extends Status {
  station: string;
  version: string;
  simulated: boolean;
  passes: number;
  views_per_ring: number;
  cameras: { id: string; elevation_deg?: number }[];
  steps: { name: string; options: Record<string, unknown> }[];
  time: string;
}

export type CaseState = "scanning" | "building" | "done" | "failed" | "cancelled";

export interface Case {
  id: number;
  number: string;
  created: string;
  state: CaseState;
  priority: number;
  hold?: string;
  damage?: string[];
  verified?: string;
  removed?: string;
  seconds_left?: number;
}

export interface Job {
  id: number;
  step: string;
  state: "waiting" | "running" | "done" | "failed" | "cancelled";
  options: Record<string, unknown>;
  seconds: number;
  peak_mib: number;
  version: string;
  error: string;
  log: string;
  ended: string;
  inputs: Record<string, number>;
  approved?: { by: string; time: string; note: string };
}

export interface Delivery {
  id: number;
  target: string;
  state: "queued" | "sending" | "waiting" | "rejected" | "held" | "delivered";
  attempts: number;
  next_attempt: string | null;
  last_error: string | null;
  delivered: string | null;
}

export interface WholeCase extends Case {
  jobs: Job[];
  deliveries: Delivery[];
  targets: string[];
  events: { time: string; what: string }[];
}

export interface ArtifactFile {
  path: string;
  bytes: number;
  sha256: string;
}

export interface ScanView {
  camera: string;
  pass: number;
  angle_deg?: number;
  rejected?: string;
}

export interface Finding {
  verdict: "ok" | "warning" | "failure";
  topic: string;
  what: string;
  advice: string;
}

export interface Account {
  name: string;
  role: Role;
  created: string;
  disabled: boolean;
}

export interface AuditEntry {
  number: number;
  time: string;
  who: string;
  what: string;
  case: string;
  details: Record<string, unknown>;
}

/** Why the station did not do what it was asked. */
export class Refusal extends Error {
  constructor(
    readonly status: number,
    readonly code: string,
    words: string,
  ) {
    super(words);
  }
}

const root = "/api/v1";
let csrf = "";
let signedOut: () => void = () => {};

/** Called whenever the station no longer knows who we are. */
export function onSignedOut(then: () => void): void {
  signedOut = then;
}

export function useToken(signIn: SignIn): SignIn {
  csrf = signIn.csrf;
  return signIn;
}

async function refusalOf(response: Response): Promise<Refusal> {
  const answer: { error?: string; code?: string } = await response.json().catch(() => ({}));
  return new Refusal(response.status, answer.code ?? "failed", answer.error ?? response.statusText);
}

export async function ask(method: string, path: string, body?: unknown): Promise<Response> {
  const headers: Record<string, string> = {};
  if (body !== undefined) headers["Content-Type"] = "application/json";
  if (method !== "GET") headers["X-CSRF-Token"] = csrf;
  let response: Response;
  try {
    response = await fetch(root + path, {
      method,
      headers,
      body: body === undefined ? undefined : JSON.stringify(body),
    });
  } catch {
    throw new Refusal(0, "unreachable", "the station does not answer");
  }
  if (response.ok) return response;
  const refusal = await refusalOf(response);
  if (refusal.code === "signed_out") signedOut();
  throw refusal;
}

export async function get<T>(path: string): Promise<T> {
  return (await ask("GET", path)).json();
}

export async function send<T>(method: string, path: string, body?: unknown): Promise<T> {
  const response = await ask(method, path, body);
  return response.status === 204 ? (undefined as T) : response.json();
}

export function fileAddress(job: number, path: string): string {
  return `${root}/jobs/${job}/files/${path.split("/").map(encodeURIComponent).join("/")}`;
}

export const eventsAddress = root + "/events";
