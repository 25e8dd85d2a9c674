"""How much an asset's occluders may cover beside their meshes."""

from __future__ import annotations

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    # By hand: Alembic leaves the check of an added column out, and would else copy the table,
    # which takes all jobs along as the old one is dropped.
    double = "DOUBLE" if op.get_bind().dialect.name == "sqlite" else "DOUBLE PRECISION"
    op.execute(
        f"ALTER TABLE assets ADD COLUMN max_overhang {double}"
        " CONSTRAINT ck_assets_max_overhang CHECK (max_overhang >= 0)"
    )


def downgrade() -> None:
    op.drop_column("assets", "max_overhang")
