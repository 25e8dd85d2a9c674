"""The first tables: assets, jobs with their files, keys and deliveries."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Document, Text, whole

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "assets",
        sa.Column("number", whole(), primary_key=True),
        sa.Column("id", sa.String(32), nullable=False, unique=True),
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("name", Text(), nullable=False),
        sa.Column("folded", Text(), nullable=False),
        sa.Column("created", sa.Double, nullable=False),
        sa.Column("min_precision", sa.Double),
        sa.Column("min_recall", sa.Double),
        sa.UniqueConstraint("tenant", "name"),
        sa.CheckConstraint("length(name) BETWEEN 1 AND 300", name="name"),
        sa.CheckConstraint("min_precision BETWEEN 0 AND 1", name="min_precision"),
        sa.CheckConstraint("min_recall BETWEEN 0 AND 1", name="min_recall"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_assets_name", "assets", ["name", "number"])

    op.create_table(
        "jobs",
        sa.Column("number", whole(), primary_key=True),
        sa.Column("id", sa.String(32), nullable=False, unique=True),
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("kind", sa.String(16), nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("name", Text(), nullable=False),
        sa.Column("options", Document(), nullable=False),
        sa.Column("version", Text(), nullable=False),
        sa.Column("work_key", sa.String(64), nullable=False),
        sa.Column("created", sa.Double, nullable=False),
        sa.Column("started", sa.Double),
        sa.Column("ended", sa.Double),
        sa.Column("attempt", whole(), nullable=False),
        sa.Column("attempts", whole(), nullable=False),
        sa.Column("asset_number", whole(), sa.ForeignKey("assets.number", ondelete="CASCADE")),
        sa.Column("webhook", Text()),
        sa.Column("cancel_asked", sa.Boolean, nullable=False),
        sa.Column("failure", Document()),
        sa.Column("summary", Document()),
        sa.Column("reused", sa.String(32)),
        sa.Column("retry_of", sa.String(32)),
        sa.Column("owner", Text()),
        sa.Column("beat", whole(), nullable=False),
        sa.Column("lease_seconds", sa.Double, nullable=False),
        sa.CheckConstraint("kind IN ('occluder', 'evaluation', 'scene', 'tradeoff')", name="kind"),
        sa.CheckConstraint(
            "state IN ('queued', 'running', 'succeeded', 'failed', 'cancelled')", name="state"
        ),
        sa.CheckConstraint("attempt BETWEEN 0 AND attempts", name="attempt"),
        sa.CheckConstraint(
            "(state IN ('succeeded', 'failed', 'cancelled')) = (ended IS NOT NULL)", name="ended"
        ),
        sa.CheckConstraint("(state = 'running') = (owner IS NOT NULL)", name="owner"),
        sa.CheckConstraint("(state = 'failed') = (failure IS NOT NULL)", name="failure"),
        sa.CheckConstraint("(state = 'succeeded') = (summary IS NOT NULL)", name="summary"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_jobs_tenant", "jobs", ["tenant", "number", "state", "kind", "created"])
    op.create_index("ix_jobs_tenant_state", "jobs", ["tenant", "state", "number"])
    op.create_index("ix_jobs_state", "jobs", ["state", "number"])
    op.create_index("ix_jobs_asset", "jobs", ["asset_number", "state", "number", "kind"])
    op.create_index("ix_jobs_work", "jobs", ["work_key", "tenant", "state", "number"])
    op.create_index("ix_jobs_ended", "jobs", ["ended"])

    op.create_table(
        "job_files",
        sa.Column(
            "job_number",
            whole(),
            sa.ForeignKey("jobs.number", ondelete="CASCADE"),
            primary_key=True,
        ),
        sa.Column("name", Text(), primary_key=True),
        sa.Column("digest", sa.String(64), nullable=False),
        sa.Column("size", whole(), nullable=False),
        sa.Column("media_type", Text(), nullable=False),
        sa.Column("is_input", sa.Boolean, nullable=False),
    )
    op.create_index("ix_job_files_digest", "job_files", ["digest"])
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

    op.create_table(
        "deliveries",
        sa.Column("number", whole(), primary_key=True),
        sa.Column("id", sa.String(32), nullable=False, unique=True),
        sa.Column(
            "job_number",
            whole(),
            sa.ForeignKey("jobs.number", ondelete="CASCADE"),
            nullable=False,
        ),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("url", Text(), nullable=False),
        sa.Column("attempt", whole(), nullable=False),
        sa.Column("since", sa.Double, nullable=False),
        sa.Column("due", sa.Double, nullable=False),
        sa.Column("reason", Text()),
        sa.CheckConstraint("state IN ('waiting', 'delivered', 'given_up')", name="state"),
        sqlite_autoincrement=True,
    )
    op.create_index("ix_deliveries_due", "deliveries", ["state", "due"])
    op.create_index("ix_deliveries_job_number", "deliveries", ["job_number"])

    op.create_table(
        "api_keys",
        sa.Column("number", whole(), primary_key=True),
        sa.Column("id", sa.String(32), nullable=False, unique=True),
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("name", Text(), nullable=False),
        sa.Column("scope", sa.String(16), nullable=False),
        sa.Column("hint", Text(), nullable=False),
        sa.Column("digest", sa.String(64), nullable=False, unique=True),
        sa.Column("created", sa.Double, nullable=False),
        sa.Column("last_used", sa.Double),
        sa.Column("revoked", sa.Double),
        sa.CheckConstraint("scope IN ('read', 'write', 'admin')", name="scope"),
        sqlite_autoincrement=True,
    )


def downgrade() -> None:
    for table in (
        "api_keys", "deliveries", "idempotency_keys", "job_files", "jobs", "assets",
    ):  # fmt: skip
        op.drop_table(table)
