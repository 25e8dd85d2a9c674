"""Assets in the database; see :class:`service.jobs.asset.AssetStore` for what is promised."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping
from dataclasses import asdict
from unicodedata import normalize

from sqlalchemy import ColumnElement, Select, delete, select, tuple_
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from service.errors import BadRequestError, ConflictError, NotFoundError
from service.jobs.asset import (
    Asset,
    AssetPage,
    FailedUpload,
    RemovedAsset,
    RunNumbers,
    RunPage,
    Standing,
    Thresholds,
)
from service.jobs.job import JobState
from service.journal import COMMAND_LINE, Action, Actor
from service.storage.asset_standings import (
    all_failed,
    all_runs_at,
    all_standings,
    change_stamp,
    failed_upload_of,
    numbers_of,
    standing_of,
)
from service.storage.database import Database, dialect_insert, retried
from service.storage.journal_store import note
from service.storage.rows import (
    asset_named,
    asset_of,
    find_asset,
    is_run,
    job_of,
    read_folders,
    thresholds_of,
    with_runs,
)
from service.storage.tables import AssetRow, FolderRow, JobRow


class SqlAssetStore:
    """Assets and their runs.  A list is one query, whose cost follows the page."""

    def __init__(self, database: Database, clock: Callable[[], float] | None = None) -> None:
        self._database = database
        self._clock = clock or database.clock

    def assets(
        self,
        tenant: str | None,
        *,
        name: str | None = None,
        contains: str = "",
        after: str | None = None,
        limit: int = 100,
    ) -> AssetPage:
        """Raises :class:`~service.errors.BadRequestError` for what is no cursor."""
        query = with_runs(tenant).where(AssetRow.goes.is_(None)).limit(limit + 1)
        if name is not None:
            query = query.where(AssetRow.name == name)
        if name is None or tenant is None:  # else there is one at most
            query = query.order_by(AssetRow.name, AssetRow.number)
        if contains:
            part = normalize("NFC", contains).casefold()
            query = query.where(AssetRow.folded.contains(part, autoescape=True))
        if after is not None:
            query = query.where(tuple_(AssetRow.name, AssetRow.number) > _position(after))
        with self._database.reading() as session:
            found = session.execute(query).all()
            folders = read_folders(session, *(row.tenant for row, *_ in found))
            page = tuple(asset_of(*one, folders) for one in found[:limit])
            return AssetPage(page, _cursor(found[limit - 1][0]) if len(found) > limit else None)

    def asset(self, tenant: str | None, asset_id: str) -> Asset:
        with self._database.reading() as session:
            return _read_asset(session, _find(session, tenant, asset_id))

    def runs(
        self, tenant: str | None, asset_id: str, *, before: int | None = None, limit: int = 100
    ) -> RunPage:
        with self._database.reading() as session:
            query = (
                select(JobRow)
                .where(
                    JobRow.asset_number == _find(session, tenant, asset_id).number,
                    is_run(JobRow),
                )
                .order_by(JobRow.number.desc())
                .limit(limit + 1)
            )
            if before is not None:
                query = query.where(JobRow.number < before)
            found = [job_of(row) for row in session.scalars(query)]
        page = tuple(found[:limit])
        return RunPage(page, page[-1].number if len(found) > limit else None)

    @retried
    def put(
        self,
        tenant: str,
        name: str,
        thresholds: Thresholds,
        *,
        by: Actor = COMMAND_LINE,
        before_change: Callable[[], None] = lambda: None,
    ) -> tuple[Asset, bool]:
        with self._database.writing() as session:
            row, made = asset_named(session, tenant, name, self._clock(), lock=True)
            if thresholds_of(row) != thresholds:
                before_change()
                self._demand(session, row, thresholds, by)
            return _read_asset(session, row), made

    @retried
    def set_thresholds(
        self,
        tenant: str | None,
        asset_id: str,
        thresholds: Thresholds,
        *,
        by: Actor = COMMAND_LINE,
    ) -> Asset:
        with self._database.writing() as session:
            row = _find(session, tenant, asset_id, lock=True)
            if thresholds_of(row) != thresholds:
                self._demand(session, row, thresholds, by)
            return _read_asset(session, row)

    def _demand(self, session: Session, row: AssetRow, thresholds: Thresholds, by: Actor) -> None:
        before = asdict(thresholds_of(row))
        _set_thresholds(row, thresholds)
        session.flush()
        note(
            session, self._clock(), row.tenant, by, Action.THRESHOLDS_SET, row.id,
            {"name": row.name, "before": before, "after": asdict(thresholds)},
        )  # fmt: skip

    def folder_thresholds(self, tenant: str) -> Mapping[str, Thresholds]:
        with self._database.reading() as session:
            return read_folders(session, tenant).get(tenant, {})

    @retried
    def set_folder_thresholds(
        self, tenant: str, folder: str, thresholds: Thresholds, *, by: Actor = COMMAND_LINE
    ) -> None:
        with self._database.writing() as session:
            made = dialect_insert(session)(FolderRow).values(tenant=tenant, path=folder)
            session.execute(made.on_conflict_do_nothing())
            row = session.get_one(FolderRow, (tenant, folder), with_for_update=True)
            before = thresholds_of(row)
            _set_thresholds(row, thresholds)
            if thresholds == Thresholds():
                session.delete(row)
            session.flush()
            if before == thresholds:
                return
            note(
                session, self._clock(), tenant, by, Action.FOLDER_THRESHOLDS_SET, folder,
                {"before": asdict(before), "after": asdict(thresholds)},
            )  # fmt: skip

    @retried
    def rename(
        self, tenant: str | None, asset_id: str, name: str, *, by: Actor = COMMAND_LINE
    ) -> Asset:
        with self._database.writing() as session:
            row = _find(session, tenant, asset_id, lock=True)
            if row.name != name:
                _check_free(session, row.tenant, name)
                told = {"before": row.name, "after": name}
                row.name, row.folded = name, name.casefold()
                try:
                    session.flush()
                except IntegrityError:  # another has taken it since
                    raise _taken(name) from None
                note(session, self._clock(), row.tenant, by, Action.ASSET_RENAMED, row.id, told)
            return _read_asset(session, row)

    @retried
    def remove(self, tenant: str | None, asset_id: str, *, by: Actor = COMMAND_LINE) -> None:
        with self._database.writing() as session:
            row = _find(session, tenant, asset_id, lock=True)
            busy = session.scalars(_at_work(JobRow.asset_number == row.number).limit(1)).first()
            if busy is not None:
                raise ConflictError(
                    f"the job '{busy}' of the asset has not ended",
                    remedy="cancel its jobs or wait for them, then remove it",
                )
            action, told = Action.ASSET_REMOVED, {"name": row.name}
            note(session, self._clock(), row.tenant, by, action, row.id, told)
            session.execute(delete(AssetRow).where(AssetRow.number == row.number))

    @retried
    def remove_later(
        self, tenant: str | None, asset_id: str, goes: float, *, by: Actor = COMMAND_LINE
    ) -> Asset:
        with self._database.writing() as session:
            row = _find(session, tenant, asset_id, lock=True)
            row.goes = goes
            session.flush()
            action, told = Action.ASSET_REMOVED, {"name": row.name, "goes": goes}
            note(session, self._clock(), row.tenant, by, action, row.id, told)
            return _read_asset(session, row)

    @retried
    def restore(self, tenant: str | None, asset_id: str, *, by: Actor = COMMAND_LINE) -> Asset:
        with self._database.writing() as session:
            row = _find(session, tenant, asset_id, lock=True)
            if row.goes is not None:
                row.goes = None
                session.flush()
                action, told = Action.ASSET_RESTORED, {"name": row.name}
                note(session, self._clock(), row.tenant, by, action, row.id, told)
            return _read_asset(session, row)

    def removed(self, tenant: str) -> tuple[RemovedAsset, ...]:
        query = select(AssetRow.id, AssetRow.name, AssetRow.goes)
        query = query.where(AssetRow.tenant == tenant, AssetRow.goes.is_not(None))
        with self._database.reading() as session:
            rows = session.execute(query.order_by(AssetRow.name))
            return tuple(RemovedAsset(row.id, row.name, row.goes) for row in rows)

    @retried
    def remove_due(self, now: float) -> int:
        busy = _at_work(JobRow.asset_number == AssetRow.number).correlate(AssetRow)
        due = delete(AssetRow).where(AssetRow.goes <= now, ~busy.exists())
        with self._database.writing() as session:
            return len(session.execute(due.returning(AssetRow.number)).all())

    def standings(self, tenant: str, *, recalls: int = 20) -> tuple[Standing, ...]:
        with self._database.reading() as session:
            rows = session.execute(all_standings(tenant, recalls))
            folders = read_folders(session, tenant).get(tenant, {})
            return tuple(standing_of(row, folders) for row in rows)

    def failed(self, tenant: str, since: float) -> tuple[FailedUpload, ...]:
        with self._database.reading() as session:
            found = [
                row
                for query in all_failed(tenant, since)
                for row in session.scalars(query).unique()
            ]
            found.sort(key=lambda row: -row.number)
            return tuple(failed_upload_of(row) for row in found)

    def runs_at(self, tenant: str, moment: float) -> Mapping[str, RunNumbers]:
        with self._database.reading() as session:
            rows = session.execute(all_runs_at(tenant, moment))
            return {row.id: numbers_of(row) for row in rows}

    def stamp(self, tenant: str) -> Hashable:
        with self._database.reading() as session:
            return tuple(session.execute(change_stamp(tenant)).one())


def _find(session: Session, tenant: str | None, asset_id: str, *, lock: bool = False) -> AssetRow:
    query = select(AssetRow).where(AssetRow.id == asset_id)
    row = session.scalars(query.with_for_update() if lock else query).first()
    if row is None or tenant not in (None, row.tenant):
        raise NotFoundError(
            f"there is no asset '{asset_id}'", remedy="look for it in the list, /v1/assets"
        )
    return row


def _read_asset(session: Session, row: AssetRow) -> Asset:
    """An asset with what its runs say of it."""
    query = with_runs(None).where(AssetRow.number == row.number)
    return asset_of(*session.execute(query).one(), read_folders(session, row.tenant))


def _set_thresholds(row: AssetRow | FolderRow, thresholds: Thresholds) -> None:
    for name, value in asdict(thresholds).items():
        setattr(row, name, value)


def _at_work(which: ColumnElement[bool]) -> Select[str]:
    """Ids of the jobs, of some, that have not ended."""
    return select(JobRow.id).where(which, JobRow.state.in_([JobState.QUEUED, JobState.RUNNING]))


def _check_free(session: Session, tenant: str, name: str) -> None:
    other = find_asset(session, tenant, name)
    if other is None:
        return
    if other.goes is not None:
        raise ConflictError(
            f"an asset of the name '{name}' was removed, and can still be restored",
            remedy="choose another name, or restore it",
        )
    raise _taken(name)


def _taken(name: str) -> ConflictError:
    return ConflictError(f"there is an asset '{name}' already", remedy="choose another name")


def _cursor(row: AssetRow) -> str:
    """The place after an asset; names alone would do within a tenant only."""
    return f"{row.number}:{row.name}"


def _position(cursor: str) -> tuple[str, int]:
    number, _, name = cursor.partition(":")
    try:
        return name, int(number)
    except ValueError:
        raise BadRequestError(
            f"'{cursor}' is no cursor", remedy="use the address that the page before gave as next"
        ) from None
