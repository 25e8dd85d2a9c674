"""Which files of a job's result are stored as it ends."""

from __future__ import annotations

from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # By hand: Alembic leaves the check of an added column out.
    op.execute(
        "ALTER TABLE jobs ADD COLUMN keep VARCHAR(16) DEFAULT 'all' NOT NULL"
        " CONSTRAINT ck_jobs_keep CHECK (keep IN ('all', 'lean'))"
    )


def downgrade() -> None:
    op.drop_column("jobs", "keep")
