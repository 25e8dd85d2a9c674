"""When a key ends by itself, which one it replaces, and a journal of who did what."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.add_column("api_keys", sa.Column("expires", sa.Double()))
    op.add_column("api_keys", sa.Column("replaces", sa.String(32)))
    op.add_column(
        "api_keys",
        sa.Column("curates", sa.Boolean(), nullable=False, server_default=sa.text("0")),
    )
    # What keys to write could do until now they go on doing: nobody's build may break by night.
    op.execute("UPDATE api_keys SET curates = 1 WHERE scope = 'write'")
    op.create_table(
        "journal",
        sa.Column("number", sa.Integer, primary_key=True),
        sa.Column("at", sa.Double, nullable=False, index=True),
        sa.Column("tenant", sa.String, nullable=False),
        sa.Column("actor", sa.String, nullable=False),
        sa.Column("address", sa.String),
        sa.Column("action", sa.String, nullable=False),
        sa.Column("subject", sa.String, nullable=False),
        sa.Column("details", sa.JSON, nullable=False),
        sa.PrimaryKeyConstraint("number", name="pk_journal"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_journal_tenant", "journal", ["tenant", "number", "at"])


def downgrade() -> None:
    op.drop_table("journal")
    for column in ("curates", "replaces", "expires"):
        op.drop_column("api_keys", column)
