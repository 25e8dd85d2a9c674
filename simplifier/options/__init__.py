"""What users choose: a frozen dataclass a command, and one a stage that the command's fields reach.

A field carries its kind, limits, unit and sentence (``fields.py``).  The command line, the HTTP
schema, forms, manifests and checks are made of the fields of a class; a stage's field that is the
command's own is declared by :func:`~simplifier.options.fields.shared`.  So an option is written
down once, and reaches its stage by its name.

Nothing here takes long to import: a process that only describes options stays small.
"""
