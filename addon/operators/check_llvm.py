"""Say in the preferences whether LLVM works for Mitsuba, as `tactile doctor` does on the command line."""

import bpy

from ..process.jobs import Job, JobFolder
from ..process.tracer_process import close_all
from ..settings import preferences
from ..settings.reports import TactileOperator, require


class TACTILE_OT_check_llvm(TactileOperator):
    """Try LLVM in another process: it needs some seconds, and a bad library ends that process alone"""

    bl_idname = "tactile.check_llvm"
    bl_label = "Check"
    bl_options = {"REGISTER"}  # noqa: RUF012 (no part of the file)

    def _work(self, context: bpy.types.Context) -> None:
        require("mitsuba")
        close_all()  # workers that draw keep the library they began with
        with JobFolder() as folder:
            job = Job("variant", folder)
            try:
                job.wait()
            finally:
                job.cancel()
            verdict = (folder / "variant.txt").read_text(encoding="utf-8")
        chosen = preferences.addon_preferences(context)
        if chosen is not None:
            chosen.verdict = verdict
        self.report({"INFO"}, verdict)


CLASSES = (TACTILE_OT_check_llvm,)
