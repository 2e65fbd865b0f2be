"""Base of the operators whose work is done in another process while Blender stays usable."""

from __future__ import annotations

from typing import ClassVar

import bpy

from ..process.jobs import Job, JobFolder
from ..settings.reports import Refused, TactileOperator, reported

_STEP = 0.1  # s between polls of the worker


class JobOperator(TactileOperator):
    """Base of operators that do a job in another process: ``begin`` starts the job, ``finish`` takes its result.
    stopped : text that is reported after Esc"""

    stopped: ClassVar[str] = "Stopped; the scene is as it was"
    _job: Job | None = None
    _folder: JobFolder | None = None
    _timer: bpy.types.Timer | None = None
    _scene = 0  # session_uid of the scene that it began in

    def begin(self, context: bpy.types.Context) -> None:
        """Start the job: set ``_folder`` and ``_job``, or leave both None if no job is needed. Raises TactileError."""
        raise NotImplementedError

    def finish(self, context: bpy.types.Context) -> None:
        """Put the result into the scene; raises TactileError."""
        raise NotImplementedError

    def _work(self, context: bpy.types.Context) -> None:
        """Run the job and wait for its end. Blender calls this without a window or from a script, else ``invoke``."""
        try:
            self.begin(context)
            if self._job is not None:
                self._job.wait()
            self.finish(context)
        finally:
            self.cancel(context)

    def invoke(self, context: bpy.types.Context, _event: bpy.types.Event) -> set[str]:
        """Start the job from the window; Blender stays usable while it runs."""
        try:
            with reported(self):
                self.begin(context)
                if self._job is None:
                    self.finish(context)
        except Refused:
            self.cancel(context)
            return {"CANCELLED"}
        if self._job is None:
            return {"FINISHED"}
        self._scene = context.scene.session_uid
        self._timer = context.window_manager.event_timer_add(_STEP, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.window_manager.progress_begin(0, 100)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Handle an event: Esc stops the job, the timer's polls it; Blender calls this."""
        if event.type == "ESC":
            self.cancel(context)
            self.report({"WARNING"}, self.stopped)
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            with reported(self):
                over = self._job.poll()
                share = round(100 * self._job.share)
                context.window_manager.progress_update(share)
                words = f"{self._job.stage or 'Starting'}: {share} %"
                if over and context.scene.session_uid != self._scene:
                    over, words = False, "Done, for the scene that it began in: go back to it"
                context.workspace.status_text_set(f"{words}   (Esc stops)")
                if over:
                    self.finish(context)
        except Refused:
            self.cancel(context)
            return {"CANCELLED"}
        if over:
            self.cancel(context)
            return {"FINISHED"}
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        """Stop the job and remove its files; Blender calls it too, when it closes or another file is opened."""
        if self._job is not None:
            self._job.cancel()
            self._job = None
        if self._folder is not None:
            self._folder.close()
            self._folder = None
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            context.window_manager.progress_end()
            context.workspace.status_text_set(None)
            self._timer = None
