"""Run by Alembic: the scripts, on the connection that :mod:`service.storage.database` gives."""

from __future__ import annotations

from alembic import context

import service.storage.blobs.tables  # noqa: F401 - so that the metadata has them
from service.storage.tables import Base

context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=Base.metadata,
    transactional_ddl=True,
)
with context.begin_transaction():
    context.run_migrations()
