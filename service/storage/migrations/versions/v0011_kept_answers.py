"""Answers to requests under a key, of every kind, in place of jobs alone."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Document, Text, whole

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.drop_index("ix_idempotency_keys_job_number", "idempotency_keys")
    op.rename_table("idempotency_keys", "old_idempotency_keys")
    if op.get_bind().dialect.name != "sqlite":  # where names of keys are those of the whole schema
        op.execute("ALTER INDEX pk_idempotency_keys RENAME TO pk_old_idempotency_keys")
    op.create_table(
        "idempotency_keys",
        sa.Column("tenant", Text(), primary_key=True),
        sa.Column("key", Text(), primary_key=True),
        sa.Column("fingerprint", sa.String(64), nullable=False),
        sa.Column("created", sa.Double, nullable=False),
        sa.Column("status", whole()),
        sa.Column("headers", Document()),
        sa.Column("body", sa.LargeBinary),
        sa.Column("job_id", sa.String(32)),
        sa.PrimaryKeyConstraint("tenant", "key", name="pk_idempotency_keys"),
    )
    op.create_index("ix_idempotency_keys_created", "idempotency_keys", ["created"])
    # Uploads that are sent again over the change of version are still known: 200 has their job told
    # as it is.
    op.execute(
        "INSERT INTO idempotency_keys (tenant, key, fingerprint, created, status, job_id)"
        " SELECT old.tenant, old.key, old.fingerprint, jobs.created, 200, jobs.id"
        " FROM old_idempotency_keys AS old JOIN jobs ON jobs.number = old.job_number"
    )
    op.drop_table("old_idempotency_keys")


def downgrade() -> None:
    op.drop_table("idempotency_keys")
    op.create_table(
        "idempotency_keys",
        sa.Column("tenant", Text(), primary_key=True),
        sa.Column("key", Text(), primary_key=True),
        sa.Column("fingerprint", sa.String(64), nullable=False),
        sa.Column(
            "job_number",
            whole(),
            sa.ForeignKey("jobs.number", ondelete="CASCADE"),
            nullable=False,
        ),
    )
    op.create_index("ix_idempotency_keys_job_number", "idempotency_keys", ["job_number"])
