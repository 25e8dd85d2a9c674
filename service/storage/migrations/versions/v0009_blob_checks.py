"""When the bytes of blobs were last looked at, by the folder that they lie in."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import whole

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "blob_checks",
        sa.Column("folder", whole(), nullable=False),
        sa.Column("checked", sa.Double(), nullable=False),
        sa.CheckConstraint("folder BETWEEN 0 AND 255", name="folder"),
        sa.PrimaryKeyConstraint("folder", name="pk_blob_checks"),
    )


def downgrade() -> None:
    op.drop_table("blob_checks")
