"""Process many recordings in many processes and machines; the files of a job's folder are its only state.

<job>/job.json                    what to make: inputs and their hashes, weights, options
<job>/prepared/<recording>.h5     signals of one recording, ready for the networks (``prepared_signals``)
<job>/shards/<recording>-%06d.h5  translated frames, numbered within their recording (``translate_shards``)
<job>/aside/<task>.json           a task that failed, and why; the next run tries it again
<job>/manifest.json               all shards and their hashes, once the job is done

Each file appears whole or not at all and carries the hash of its content (``checksummed``), so after any interruption
another run makes only what is missing. A task says what to make, not by whom: ``tasks.run`` is called by local
processes (``local``) and by Dask workers (``dask_cluster``), and gives the same bytes everywhere."""
