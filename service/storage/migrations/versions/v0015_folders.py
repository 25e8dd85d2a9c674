"""Thresholds of folders, and assets that were removed and can be restored."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Text

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "folders",
        sa.Column("tenant", Text(), nullable=False),
        sa.Column("path", Text(), nullable=False),
        sa.Column("min_precision", sa.Double),
        sa.Column("min_recall", sa.Double),
        sa.Column("max_overhang", sa.Double),
        sa.CheckConstraint("min_precision BETWEEN 0 AND 1", name="min_precision"),
        sa.CheckConstraint("min_recall BETWEEN 0 AND 1", name="min_recall"),
        sa.CheckConstraint("max_overhang >= 0", name="max_overhang"),
        sa.PrimaryKeyConstraint("tenant", "path", name="pk_folders"),
    )
    op.add_column("assets", sa.Column("goes", sa.Double))
    some = sa.text("goes IS NOT NULL")
    op.create_index("ix_assets_goes", "assets", ["goes"], sqlite_where=some, postgresql_where=some)


def downgrade() -> None:
    op.drop_index("ix_assets_goes", "assets")
    op.drop_column("assets", "goes")
    op.drop_table("folders")
