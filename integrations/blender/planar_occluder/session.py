"""The occluders of one press of the button, made one after the other."""

from dataclasses import dataclass

import bpy

from . import ply
from .geometry import attach, frame_of, is_occluder, triangles_of
from .materials import KEEP, omitted_words
from .preferences import start_run
from .run import RunError

_FIGURES = "triangles", "precision", "recall", "error_bound"
_FLATTENED = 1e-12  # determinant of an object's scale below which it has no inverse


@dataclass(frozen=True)
class Task:
    """An anchor and the objects that its occluder stands for.

    By session id: a reference would not outlive an undo while the work is under way.
    """

    anchor: int
    members: tuple[int, ...]


def tasks_of(context):
    """What the selection asks for, by the scene's settings; occluders are no asset."""
    chosen = [item for item in context.selected_objects if not is_occluder(item)]
    ids = tuple(item.session_uid for item in chosen)
    if context.scene.planar_occluder.scope == "EACH" or not chosen:
        return [Task(one, (one,)) for one in ids]
    active = context.active_object
    return [Task(active.session_uid if active in chosen else ids[0], ids)]


class Session:
    """``made`` counts, ``failures`` says what was wrong with the others.

    ``remarks``  what was left out of which object.
    """

    def __init__(self, context):
        settings = context.scene.planar_occluder
        self._options, self._suffix = settings.options(), settings.suffix
        self._tasks = tasks_of(context)
        self._count = len(self._tasks)
        self._task = self._run = self._frame = None
        self.made = 0
        self.failures, self.remarks = [], []

    @property
    def done(self):
        return not self._tasks and self._run is None

    @property
    def share(self):
        """Of all the work, 0 to 1."""
        ended = self._count - len(self._tasks) - (self._run is not None)
        current = self._run.share or 0.0 if self._run else 0.0
        return (ended + current) / max(self._count, 1)

    @property
    def step_name(self):
        return f"Occluder {self._count - len(self._tasks)} of {self._count}"

    def step(self, context):
        """Start what is next, or see whether what runs has ended; at once."""
        try:
            if self._run is None:
                self._task = self._tasks.pop(0)
                self._run = self._started(context)
            elif (made := self._run.poll()) is not None:
                self._run = None
                self._keep(context, made)
                self.made += 1
        except (RunError, OSError, ValueError) as error:
            self._run = None
            self.failures.append(f"{_name_of(self._task.anchor)}: {error}")

    def cancel(self):
        self._tasks.clear()
        if self._run is not None:
            self._run.cancel()
            self._run = None

    def _started(self, context):
        anchor = _found(self._task.anchor)
        if abs(anchor.matrix_world.to_3x3().determinant()) < _FLATTENED:
            raise RunError(
                "its scale is 0 along an axis, so that it has no inside: change the scale"
            )
        members = [item for item in bpy.data.objects if item.session_uid in self._task.members]
        self._frame = frame_of(anchor)  # as it is now: the anchor may be moved meanwhile
        vertices, faces, omitted = triangles_of(
            context, members, anchor, self._options["transparent"]
        )
        if not len(faces) and omitted:
            raise RunError(f"nothing opaque is left: {omitted_words(omitted)}; {KEEP}")
        if not len(faces):
            raise RunError("it shows no triangles: select objects with faces")
        if omitted:
            self.remarks.append(f"{anchor.name}: {omitted_words(omitted)}; {KEEP}")
        return start_run(context, ply.encode(vertices, faces), self._options)

    def _keep(self, context, made):
        anchor = _found(self._task.anchor)
        vertices, faces = ply.decode(made.ply)
        figures = {
            name: made.report[name] for name in _FIGURES if made.report.get(name) is not None
        }
        attach(context, anchor, self._frame, (vertices, faces), anchor.name + self._suffix, figures)


def _found(uid):
    for item in bpy.data.objects:
        if item.session_uid == uid:
            return item
    raise RunError("it is there no more")


def _name_of(uid):
    return next((item.name for item in bpy.data.objects if item.session_uid == uid), "an object")
