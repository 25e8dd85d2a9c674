"""The button: in a window it goes on beside the work, in a script it waits."""

import time

import bpy

from .session import Session

_GLANCE = 0.1  # seconds


class OBJECT_OT_make_occluder(bpy.types.Operator):
    """Make occluders of few triangles for the selected objects"""

    bl_idname = "object.make_occluder"
    bl_label = "Make Occluder"
    bl_options = {"UNDO"}  # noqa: RUF012

    _under_way = False  # of the class: one at a time

    @classmethod
    def poll(cls, context):
        if cls._under_way:
            cls.poll_message_set("Occluders are being made")
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set("Leave edit mode first")
            return False
        return True

    def execute(self, context):
        """From a script: until all are made."""
        session = Session(context)
        while not session.done:
            session.step(context)
            time.sleep(0.0 if session.done else _GLANCE)
        return self._told(session)

    def invoke(self, context, _event):
        """From the panel: a timer looks after the work, Esc ends it."""
        self._session = Session(context)
        if self._session.done:
            return self._told(self._session)
        self._begin = time.monotonic()
        manager = context.window_manager
        self._timer = manager.event_timer_add(_GLANCE, window=context.window)
        manager.progress_begin(0.0, 1.0)
        manager.modal_handler_add(self)
        OBJECT_OT_make_occluder._under_way = True
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        session = self._session
        if event.type == "ESC":
            session.cancel()
        elif event.type == "TIMER":
            session.step(context)
            context.window_manager.progress_update(session.share)
            context.workspace.status_text_set(
                f"{session.step_name}, {time.monotonic() - self._begin:.0f} s. Esc ends"
            )
        if not session.done:
            return {"PASS_THROUGH"}
        self._leave(context)
        return self._told(session)

    def cancel(self, context):
        """The window or the file is closed."""
        self._session.cancel()
        self._leave(context)

    def _leave(self, context):
        OBJECT_OT_make_occluder._under_way = False
        context.window_manager.event_timer_remove(self._timer)
        context.window_manager.progress_end()
        context.workspace.status_text_set(None)

    def _told(self, session):
        for remark in session.remarks:
            self.report({"WARNING"}, remark)
        for failure in session.failures:
            self.report({"WARNING" if session.made else "ERROR"}, failure)
        if session.made:
            self.report({"INFO"}, f"{session.made} occluder{'s' * (session.made > 1)} made")
            return {"FINISHED"}
        if not session.failures:
            self.report({"ERROR"}, "Nothing was made: select objects that are no occluders")
        return {"CANCELLED"}


def register():
    bpy.utils.register_class(OBJECT_OT_make_occluder)


def unregister():
    bpy.utils.unregister_class(OBJECT_OT_make_occluder)
