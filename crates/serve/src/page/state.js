// The state of rig and scan, as the server tells it.

const empty = () => ({ scan: null, hand: { open: false, doing: "" }, lease: { holder: null, asked: [], taking: null }, queue: {}, lines: [], viewers: 0, rig: null, connected: false });

export const state = empty();
const listeners = [];

// Long enough to look something up in another tab.
const HIDDEN_MS = 3000;

/** Calls `listener(kind)` after each change. */
export const onChange = (listener) => listeners.push(listener);
const changed = (kind) => listeners.forEach((listener) => listener(kind));

/** A message of the server. */
function take(kind, value) {
  switch (kind) {
    case "all": Object.assign(state, value); break;
    case "scan": state.scan = value; break;
    case "readings": if (state.scan) state.scan.readings.push(...value); break;
    case "progress": if (state.scan) Object.assign(state.scan, { stage: value.stage, reason: value.reason, has_report: value.has_report }); break;
    case "air": if (state.scan) state.scan.air = value; break;
    case "line": state.lines.push(value); if (state.lines.length > 200) state.lines.shift(); break;
    default: state[kind] = value;
  }
  changed(kind);
}

/**
 * Follows the server; the browser connects again by itself if the connection is lost. A browser keeps at most six connections to a server: a page that
 * nobody sees gives its own up, unless `keeps()` says that it is needed.
 */
export function follow(onLost, keeps) {
  let source = null, hidden = null;
  const open = () => {
    source = new EventSource("/api/live");
    for (const kind of ["all", "scan", "readings", "progress", "air", "hand", "lease", "queue", "line", "viewers"]) {
      source.addEventListener(kind, (event) => { state.connected = true; take(kind, JSON.parse(event.data)); });
    }
    source.onerror = () => {
      if (state.connected) { state.connected = false; changed("connection"); }
      // A server that was restarted does not know this session any more.
      if (source.readyState === EventSource.CLOSED) onLost();
    };
    source.onopen = () => { state.connected = true; changed("connection"); };
  };
  document.addEventListener("visibilitychange", () => {
    clearTimeout(hidden);
    if (document.hidden) hidden = setTimeout(() => { if (!keeps()) { source.close(); source = null; } }, HIDDEN_MS);
    else if (!source) open();
  });
  open();
}
