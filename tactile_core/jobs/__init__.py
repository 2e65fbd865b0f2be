"""Jobs behind the verbs: a recording, scene or folder in, a result folder out."""
