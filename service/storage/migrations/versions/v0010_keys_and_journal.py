"""When a key ends by itself, which one it replaces, and a journal of who did what."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Document, Text, whole

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("api_keys", sa.Column("expires", sa.Double()))
    op.add_column("api_keys", sa.Column("replaces", sa.String(32)))
    op.add_column(
        "api_keys",
        sa.Column("curates", sa.Boolean(), nullable=False, server_default=sa.false()),
    )
    # What keys to write could do until now they go on doing: nobody's build may break by night.
    op.execute("UPDATE api_keys SET curates = true WHERE scope = 'write'")
    op.create_table(
        "journal",
        sa.Column("number", whole(), primary_key=True),
        sa.Column("at", sa.Double, nullable=False, index=True),
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("actor", Text(), nullable=False),
        sa.Column("address", Text()),
        sa.Column("action", Text(), nullable=False),
        sa.Column("subject", Text(), nullable=False),
        sa.Column("details", Document(), nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_journal"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_journal_tenant", "journal", ["tenant", "number", "at"])


def downgrade() -> None:
    op.drop_table("journal")
    for column in ("curates", "replaces", "expires"):
        op.drop_column("api_keys", column)
