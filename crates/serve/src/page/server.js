// Requests to the server, and the session of this page.

let session = null;

/** Who this page is: {id, name, role, csrf, view_key}, or null. */
export const me = () => session;

/** A request; throws an Error with the server's words. */
export async function call(method, path, body) {
  const headers = {};
  if (session) headers["X-Fieldgap-CSRF"] = session.csrf;
  if (body !== undefined) headers["Content-Type"] = "application/json";
  const answer = await fetch(path, { method, headers, body: body === undefined ? undefined : JSON.stringify(body), cache: "no-store" });
  const json = await answer.json();
  if (!answer.ok) {
    const error = new Error(`${json.error}. ${json.remedy}.`);
    error.status = answer.status;
    error.concerns = json.concerns ?? [];
    throw error;
  }
  return json;
}

export const get = (path) => call("GET", path);
export const post = (path, body = {}) => call("POST", path, body);

/** Opens the session: by the one-time link in the address, or the one of the cookie. */
export async function logIn() {
  const link = location.hash.match(/^#link=([\w-]+)$/);
  if (link) {
    // The secret must not stay in the address, where it would be copied or seen.
    history.replaceState(null, "", "/#now");
    session = await post("/api/session", { secret: link[1] });
    return;
  }
  session = await get("/api/session");
}

/** Opens the session by name and password. */
export async function logInAs(name, password) {
  session = await post("/api/session", { name, password });
}

export async function logOut() {
  await post("/api/session/end");
  session = null;
}

export const ranks = { viewer: 0, operator: 1, admin: 2 };
export const may = (role) => session !== null && ranks[session.role] >= ranks[role];
