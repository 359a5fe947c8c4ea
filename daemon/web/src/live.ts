// What the station says by itself: its status and its log, as they come.
import { eventsAddress, get, type Station, type Status } from "./api";

export interface LogLine {
  time: string;
  words: string;
}

type Listener = () => void;

class Live {
  station: Station | null = null;
  connected = false;
  log: LogLine[] = [];
  private source: EventSource | null = null;
  private listeners = new Set<Listener>();

  async start(): Promise<void> {
    this.stop();
    this.station = await get<Station>("/station");
    const source = new EventSource(eventsAddress);
    this.source = source;
    source.addEventListener("open", () => this.change(() => (this.connected = true)));
    source.addEventListener("error", () => this.change(() => (this.connected = false)));
    source.addEventListener("station", (event) => this.change(() => this.take(JSON.parse(event.data))));
    source.addEventListener("log", (event) =>
      this.change(() => (this.log = [...this.log.slice(-199), JSON.parse(event.data)])),
    );
  }

  stop(): void {
    this.source?.close();
    this.source = null;
    this.log = [];
  }

  /** Calls until the returned function is called. */
  listen(listener: Listener): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }

  private take(status: Status): void {
    if (this.station === null) return;
    const { station, version, simulated, passes, views_per_ring, cameras, steps, time } = this.station;
    const opened = status.state !== "starting" && this.station.state === "starting";
    this.station = { ...status, station, version, simulated, passes, views_per_ring, cameras, steps, time };
    // Whether it is a simulated one is known once it is open.
    if (opened) void get<Station>("/station").then((now) => this.change(() => (this.station = now)));
  }

  private change(how: () => void): void {
    how();
    for (const listener of this.listeners) listener();
  }
}

export const live = new Live();
