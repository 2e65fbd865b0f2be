"""Process that does tasks of a job, JSON lines in, JSON lines out, until its input ends. ``local`` starts it; it ends
by itself when its client is killed, and leaves no partial file."""

from __future__ import annotations

import json
import logging
import os
import signal
import sys
from typing import TextIO


def serve(folder: str, requests: TextIO, replies: TextIO) -> None:
    """Answer requests, a task of the folder's job in JSON on each line, by lines of replies, until they end."""
    from . import tasks

    for line in requests:
        replies.write(json.dumps(tasks.run(folder, json.loads(line))) + "\n")
        replies.flush()


def main() -> None:
    """Serve tasks from stdin: ``python -m tactile_core.jobs.engine.task_worker FOLDER``."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group: the client decides
    replies = os.fdopen(os.dup(1), "w", encoding="utf-8")
    # What the library warns of frame by frame is in the shards as flags and confidence; thousands of lines help nobody.
    logging.getLogger(__package__.removesuffix(".jobs.engine")).setLevel(logging.ERROR)
    os.dup2(2, 1)  # whatever a library prints must not be taken for a reply
    try:
        serve(sys.argv[1], sys.stdin, replies)
    except BrokenPipeError:
        os._exit(0)  # the client has gone


if __name__ == "__main__":
    main()
