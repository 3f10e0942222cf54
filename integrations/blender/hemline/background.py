"""Runs hemline beside Blender: one job at a time, which a timer watches."""

import bpy

from .job import Job
from .playing import is_unattempted, start_playing
from .refused import Refused

CHECK_S, REST_S = 0.1, 0.6
"""Interval at which a running program is checked, and time after the last change before a live object plays [s]."""
_running: list[Job] = []


def running_job() -> Job | None:
    """Returns the job at work, or None."""
    return _running[0] if _running else None


def run_in_background(start, context, owner) -> None:
    """Starts a job and its timer.

    Args:
        start: Function that starts a job, called with the context and the object.
        context: The context.
        owner: Object that the job is for.

    Raises:
        Refused: Another job is at work, or this one cannot start.
    """
    if _running:
        raise Refused("hemline is at work on another object; wait for it, or stop it")
    _running.append(start(context, owner))
    say(owner, "", failed=False)
    if not bpy.app.timers.is_registered(watch_job):
        bpy.app.timers.register(watch_job, first_interval=CHECK_S, persistent=True)


def end_job(job: Job) -> str:
    """Waits for a job and shows its result; returns words for the user.

    Raises:
        Refused: The run failed, or the object is gone; the scene is unchanged.
    """
    try:
        job.wait()
        owner = owner_of(job)
        if owner is None:
            raise Refused("the object was removed while hemline was at work; got no result for it; start again")
        return job.show(job, owner)
    except Refused:
        job.clear()
        raise


def owner_of(job: Job):
    """Returns the object that a job is for, or None if it was removed."""
    return next((each for each in bpy.data.objects if each.session_uid == job.owner), None)


def say(owner, text: str, *, failed: bool) -> None:
    """Stores the words that the panel shows for an object."""
    owner.hemline.message, owner.hemline.failed = text, failed


def watch_job() -> float | None:
    """Timer: draws the progress of the job, and shows its result when it ends."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()
    job = running_job()
    if job is None:
        return None
    if not job.is_done:
        return CHECK_S
    _running.clear()
    try:
        text, failed = end_job(job), False
    except Refused as refused:
        text, failed = str(refused), True
    owner = owner_of(job)
    if owner is not None:
        say(owner, text, failed=failed)
    return CHECK_S  # once more, so that the end is drawn


def play_changed() -> float | None:
    """Timer: plays live objects whose settings have changed."""
    if _running:
        return REST_S
    for root in bpy.context.scene.objects:
        if root.hemline.is_root and root.hemline.live and is_unattempted(root, bpy.context.scene):
            try:
                run_in_background(start_playing, bpy.context, root)
            except Refused as refused:
                say(root, str(refused), failed=True)
                continue
            return REST_S
    return None


def on_change(settings, context) -> None:
    """Starts the timer of live objects after a change of a setting."""
    if bpy.app.timers.is_registered(play_changed):
        bpy.app.timers.unregister(play_changed)
    bpy.app.timers.register(play_changed, first_interval=REST_S)


def end_all() -> None:
    """Stops timers and the job, and removes its files; called when the extension is disabled."""
    for timer in (watch_job, play_changed):
        if bpy.app.timers.is_registered(timer):
            bpy.app.timers.unregister(timer)
    while _running:
        job = _running.pop()
        job.stop()
        job.process.wait()
        job.clear()
