// What a page shows, kept in its address: whoever is sent the link sees the same.

export function kept(name, otherwise = "") {
  return new URLSearchParams(window.location.search).get(name) ?? otherwise;
}

// Values by their names; an empty one is left out.
export function keep(values) {
  const address = new URL(window.location.href);
  for (const [name, value] of Object.entries(values)) {
    if (value === "" || value === null || value === undefined) address.searchParams.delete(name);
    else address.searchParams.set(name, value);
  }
  window.history.replaceState(window.history.state, "", address);
}

// For what Python keeps.
window.keepInAddress = keep;
