// Keeps choices, unfolded parts and places of scrolling over loading again; loads again while the campaign runs.
(() => {
  const EVERY_MS = 30000;
  const name = 'fieldgap ' + location.pathname;
  const box = document.querySelector('.matrix');
  const kept = (() => {
    try { return JSON.parse(sessionStorage.getItem(name)) || {}; } catch { return {}; }
  })();
  const parts = () => [...document.querySelectorAll('details[id]')];
  const choice = kept.by && document.getElementById(kept.by);
  if (choice) choice.checked = true;
  for (const part of parts()) if (kept.parts && part.id in kept.parts) part.open = kept.parts[part.id];
  if (box) box.scrollLeft = kept.left ?? box.scrollWidth;
  if (box && kept.down) box.scrollTop = kept.down;
  if (kept.top) scrollTo(0, kept.top);
  addEventListener('pagehide', () => {
    const open = Object.fromEntries(parts().map((part) => [part.id, part.open]));
    const by = document.querySelector('input[name=by]:checked');
    try {
      sessionStorage.setItem(name, JSON.stringify({ by: by && by.id, parts: open, left: box && box.scrollLeft,
        down: box && box.scrollTop, top: scrollY, renew: renew && renew.checked }));
    } catch { /* Without storage the page begins at its top. */ }
  });
  const renew = document.getElementById('renew');
  if (!renew) return;
  if (kept.renew === false) renew.checked = false;
  const loaded = Date.now();
  const again = () => {
    const due = Date.now() - loaded >= EVERY_MS;
    if (due && renew.checked && document.visibilityState === 'visible') location.reload();
  };
  setInterval(again, 1000);
  document.addEventListener('visibilitychange', again);
})();
