"""Export formats, one file each, found automatically; a file's name is the word after ``--to``. Each has

``BRIEF``  the layout in words
``write(source, folder, progress)``  writes ``source``, a ``finished_job.Finished``, into an empty folder and calls
           ``progress(frames done, in all)``. The same job gives the same bytes."""
