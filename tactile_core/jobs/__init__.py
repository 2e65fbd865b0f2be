"""Work behind the command's verbs: a recording, scene or folder in, a result folder out."""
