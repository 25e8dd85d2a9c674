"""Names of assets in composed form (NFC), in which they are looked for from now on."""

from __future__ import annotations

from unicodedata import normalize

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    connection = op.get_bind()
    rows = connection.exec_driver_sql("SELECT number, tenant, name FROM assets").all()
    taken = {(tenant, name) for _, tenant, name in rows}
    for number, tenant, name in rows:
        composed = normalize("NFC", name)
        # Where both forms have an asset each, neither is lost: this one is still found by its id.
        if (tenant, composed) in taken:
            continue
        taken.add((tenant, composed))
        connection.execute(
            sa.text("UPDATE assets SET name = :name, folded = :folded WHERE number = :number"),
            {"name": composed, "folded": composed.casefold(), "number": number},
        )


def downgrade() -> None:
    """Nothing: the names of before are not known, and these are names as good."""
