"""Quasar's own icons as paths: its font of all icons that there are would be a third of a page."""

from __future__ import annotations

import json

_DOWN = "M6 9l6 7 6-7z"
_CROSS = "M5 7l2-2 5 5 5-5 2 2-5 5 5 5-2 2-5-5-5 5-2-2 5-5z"
_PATHS = {
    "arrow_drop_down": _DOWN,
    "arrow_upward": "M12 4l7 8h-5v8h-4v-8H5z",
    "cancel": _CROSS,
    "check": "M9 16l-4-4-2 2 6 6L21 8l-2-2z",
    "check_circle": "M12 2a10 10 0 100 20 10 10 0 000-20zM10 17l-5-5 2-2 3 3 7-7 2 2z",
    "chevron_left": "M15 5l-7 7 7 7 2-2-5-5 5-5z",
    "chevron_right": "M9 5l7 7-7 7-2-2 5-5-5-5z",
    "close": _CROSS,
    "error": "M12 3l10 18H2zm-1 6v6h2V9zm0 8v2h2v-2z",
    "first_page": "M17 5l-7 7 7 7 2-2-5-5 5-5zM5 5h3v14H5z",
    "info": "M12 2a10 10 0 100 20 10 10 0 000-20zm-1 5v2h2V7zm0 4v6h2v-6z",
    "keyboard_arrow_down": _DOWN,
    "last_page": "M7 5l7 7-7 7-2-2 5-5-5-5zM16 5h3v14h-3z",
    "priority_high": "M10 3h4v11h-4zM10 17h4v4h-4z",
    "warning": "M12 3l10 18H2zm-1 6v6h2V9zm0 8v2h2v-2z",
}
"""Within 24 by 24, by the names that Quasar's parts ask for."""

ICONS_SCRIPT = f"""
        const iconPaths = {json.dumps(_PATHS)};
        app.config.globalProperties.$q.iconMapFn = (name) =>
          name in iconPaths ? {{ icon: iconPaths[name] }} : undefined;
"""
"""JavaScript, for where pages start Quasar."""
