"""Which object of a bucket has which blob, who puts one and who holds one."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from service.storage.column_types import Text, whole

revision = "0014"
down_revision = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "blob_objects",
        sa.Column("key", sa.String(32), nullable=False),
        sa.Column("state", sa.String(16), nullable=False),
        sa.Column("digest", sa.String(64)),
        sa.Column("size", whole()),
        sa.Column("owner", sa.String(32)),
        sa.Column("touched", whole(), nullable=False, server_default=sa.text("0")),
        sa.CheckConstraint("state IN ('writing', 'stored', 'aside', 'doomed')", name="state"),
        sa.CheckConstraint(
            "state IN ('writing', 'doomed') OR (digest IS NOT NULL AND size IS NOT NULL)",
            name="digest",
        ),
        sa.CheckConstraint("state <> 'writing' OR owner IS NOT NULL", name="owner"),
        sa.PrimaryKeyConstraint("key", name="pk_blob_objects"),
    )
    for name, columns, where, unique in (
        ("stored", ["digest"], "state = 'stored'", True),
        ("other", ["state", "key"], "state <> 'stored'", False),
        ("owner", ["owner"], "owner IS NOT NULL", False),
    ):
        op.create_index(
            f"ix_blob_objects_{name}", "blob_objects", columns, unique=unique,
            sqlite_where=sa.text(where), postgresql_where=sa.text(where),
        )  # fmt: skip
    op.create_table(
        "blob_owners",
        sa.Column("id", sa.String(32), nullable=False),
        sa.Column("until", sa.Double, nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_blob_owners"),
    )
    op.create_table(
        "blob_holds",
        sa.Column("number", whole(), nullable=False),
        sa.Column("owner", sa.String(32), nullable=False),
        sa.Column("keeping", sa.String(32), nullable=False),
        sa.Column("digest", sa.String(64), nullable=False),
        sa.ForeignKeyConstraint(
            ["owner"], ["blob_owners.id"], name="fk_blob_holds_owner", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("number", name="pk_blob_holds"),
        sqlite_autoincrement=True,
    )
    for column in ("owner", "keeping", "digest"):
        op.create_index(f"ix_blob_holds_{column}", "blob_holds", [column])
    op.create_table(
        "blob_identity",
        sa.Column("number", whole(), nullable=False),
        sa.Column("identity", sa.String(32), nullable=False),
        sa.Column("place", Text(), nullable=False),
        sa.CheckConstraint("number = 1", name="number"),
        sa.PrimaryKeyConstraint("number", name="pk_blob_identity"),
    )


def downgrade() -> None:
    for table in ("blob_identity", "blob_holds", "blob_owners", "blob_objects"):
        op.drop_table(table)
