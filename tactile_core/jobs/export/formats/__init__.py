"""Export formats, one file each, found automatically; a file's name is the word after ``--to``. Each has

``BRIEF``  the layout in words
``write(source, folder, progress)``  source is a ``finished_job.Finished``, folder an empty one; progress is called with
           (frames done, frames in all). The same job gives the same bytes.
"""
