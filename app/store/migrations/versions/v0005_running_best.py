"""Each iteration knows the best one so far: to add one takes the same time in a study of any length."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "v0005"
down_revision = "v0004"
branch_labels = None
depends_on = None

# the energy of the study's objective; the first of equals is the best
_FILL = """
WITH energies AS (
    SELECT i.study_id, i.number, s.threshold,
           CASE s.objective WHEN 'mechanical' THEN i.mechanical ELSE i.electrical END AS energy
    FROM iterations AS i JOIN studies AS s ON s.id = i.study_id
), least AS (
    SELECT study_id, number, energy, threshold,
           MIN(energy) OVER (PARTITION BY study_id ORDER BY number ROWS UNBOUNDED PRECEDING) AS so_far
    FROM energies
), marked AS (
    SELECT study_id, number,
           MAX(CASE WHEN energy = so_far AND (before IS NULL OR energy < before) THEN number END)
               OVER (PARTITION BY study_id ORDER BY number ROWS UNBOUNDED PRECEDING) AS best,
           MIN(CASE WHEN energy <= threshold THEN number END)
               OVER (PARTITION BY study_id ORDER BY number ROWS UNBOUNDED PRECEDING) AS met_by
    FROM (SELECT least.*, LAG(so_far) OVER (PARTITION BY study_id ORDER BY number) AS before FROM least) AS steps
)
UPDATE iterations SET best = marked.best, met_by = marked.met_by FROM marked
WHERE marked.study_id = iterations.study_id AND marked.number = iterations.number
"""


def upgrade() -> None:
    """To this revision."""
    with op.batch_alter_table("iterations") as table:
        table.add_column(sa.Column("best", sa.Integer(), nullable=True))
        table.add_column(sa.Column("met_by", sa.Integer(), nullable=True))
    op.execute(_FILL)
    with op.batch_alter_table("iterations") as table:
        table.alter_column("best", existing_type=sa.Integer(), nullable=False)


def downgrade() -> None:
    """From this revision."""
    with op.batch_alter_table("iterations") as table:
        table.drop_column("met_by")
        table.drop_column("best")
