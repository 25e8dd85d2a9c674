"""The sign of the pages: a solid, and the plane within that stands for it."""

ICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32">'
    '<path d="M16 2 29 9v14L16 30 3 23V9z" fill="#0b5cad"/>'
    '<path d="M16 7 24 22H8z" fill="#fff"/></svg>'
)
